/* One light followed over time by a still and a moving memory: the temporal filter of a frame in one call. */
#include "common_error.h"
#include "typical_error.h"

enum { STILL, MOVING, MEMORIES, MOST_CHANNELS = 4 };

static const double judging_s = 0.2;    /* time over which the two memories' predictions are compared [s] */
static const double moving_from = 1.6;  /* ratio of the still one's squared prediction error to the moving one's ... */
static const double moving_fully = 2.4; /* ... between which the light counts as moving */
static const double least_error = 1.2;  /* that the ratio starts from: errors of neighbouring frames are alike, and a
                                           short memory predicts them too well */
static const double usually = 0.1;      /* share of a frame in the usual squared prediction error */
static const double switched = 6.0;     /* squared prediction error over the usual one from which a frame is a switch */
static const double level_jump = 16.0;  /* the same of a level alone, from which its prediction is given up */
static const double drifting_from = 3.0;  /* mean squared prediction error of a level ... */
static const double drifting_fully = 4.5; /* ... between which it counts as drifting */
static const double followed = 4.0;     /* variance that a drifting level gains between frames, relative to a
                                           measurement's: four fifths of it are followed */

typedef struct {
    RelativeLight *frame;   /* the last frame */
    RelativeLight *told;    /* what was told last */
    Memory *memories[MEMORIES];
    CommonError *common;
    TypicalError *typical;
    double *ceiling;        /* (channels, size) natural variance of the light */
    double errors[MEMORIES]; /* squared prediction errors, lately */
    double usual;           /* squared prediction error of the better memory, usually */
    double level_errors[MOST_CHANNELS]; /* squared prediction errors of the levels, lately */
} FollowedLight;

/* 0 up to `low`, 1 from `high` on. */
static inline double between(double value, double low, double high)
{
    return fmin(fmax((value - low) / (high - low), 0.0), 1.0);
}

/* Variances grow up to those of natural light of its brightness: of its level, then relative to it. */
static void bound_levels(const FollowedLight *light, const double *values)
{
    int64_t size = light->frame->size;
    for (int64_t c = 0; c < light->frame->channels; c++) {
        double level = fmax(values[c * size], darkest);
        light->ceiling[c * size] = level * level;
    }
}

/* Begins anew from the frame. */
static void start(FollowedLight *light, const double *covariance)
{
    bound_levels(light, light->frame->values);
    for (int m = 0; m < MEMORIES; m++) {
        memory_start(light->memories[m], light->frame->values, light->frame->variance, light->ceiling);
        light->errors[m] = light->usual;
    }
    common_start(light->common, light->frame);
    typical_start(light->typical, covariance);
}

/* Lets the level of a channel go where it is seen to jump or to drift. */
static void free_levels(FollowedLight *light, double share)
{
    for (int64_t c = 0; c < light->frame->channels; c++) {
        int64_t at = c * light->frame->size;
        double level = light->frame->values[at], variance = light->frame->variance[at];
        double jumps[MEMORIES];
        for (int m = 0; m < MEMORIES; m++) {
            double distance = level - light->memories[m]->values[at];
            double known = variance + light->memories[m]->variance[at];
            jumps[m] = fmax(distance * distance - level_jump * known, 0.0);
            if (m == STILL)
                light->level_errors[c] += share * (distance * distance / known - light->level_errors[c]);
        }
        double drift = followed * variance * between(light->level_errors[c], drifting_from, drifting_fully);
        for (int m = 0; m < MEMORIES; m++)
            if (jumps[m] + drift > 0.0)
                memory_free_level(light->memories[m], (int)c, jumps[m] + drift);
    }
}

/* Judges the predictions and corrects them, dt [s] after the last estimate; 0 when the frame shows another light. */
static int take_in_frame(FollowedLight *light, const double *covariance, double dt)
{
    Judgement judged[MEMORIES];
    double shown[MEMORIES], averaged[MEMORIES], share = 1.0 - exp(-dt / judging_s);
    for (int m = 0; m < MEMORIES; m++)
        memory_judge(light->memories[m], light->frame, &judged[m]);
    double least = fmin(judged[STILL].surprise, judged[MOVING].surprise);
    if (least > switched * light->usual)
        return 0;
    light->usual += usually * (least - light->usual);
    for (int m = 0; m < MEMORIES; m++) {
        light->errors[m] += share * (judged[m].surprise - light->errors[m]);
        shown[m] = judged[m].shown;
        averaged[m] = judged[m].kept * memory_averaged(light->memories[m]);
    }
    common_learn(light->common, light->frame, shown, averaged, dt);
    free_levels(light, share);
    typical_weigh(light->typical, covariance);
    int64_t count = light->frame->channels * light->frame->size;
    for (int m = 0; m < MEMORIES; m++)
        memory_correct(light->memories[m], light->typical->innovation + m * count, light->frame);
    typical_average(light->typical, covariance, dt);
    return 1;
}

/* Tells the light, each memory as far as it is heard. */
static void tell(const FollowedLight *light)
{
    int64_t count = light->told->channels * light->told->size;
    double ratio = light->errors[STILL] / fmax(light->errors[MOVING], least_error);
    double moving = between(ratio, moving_from, moving_fully), weights[MEMORIES] = {1.0 - moving, moving};
    double independent = common_independent(light->common);
    for (int64_t j = 0; j < count; j++)
        light->told->values[j] = light->told->variance[j] = 0.0;
    for (int m = 0; m < MEMORIES; m++)
        if (weights[m] > 0.0)
            memory_tell(light->memories[m], weights[m], independent, common_left(light->common, m),
                        light->typical->diagonal, light->told);
    for (int64_t j = 0; j < count; j++)
        light->told->variance[j] = fmin(light->told->variance[j], light->ceiling[j]);
    bound_levels(light, light->told->values);
}

/* Begins with an estimate: coefficients (k, channels), complex, covariance (channels, size, size), and what its levels
   are relative to (channels). */
EXPORT void begin(FollowedLight *light, const double *coefficients, const double *covariance, const double *exposure)
{
    relative_take(light->frame, coefficients, covariance, exposure);
    start(light, covariance);
}

/* Follows the light to a frame dt [s] after the last one and tells it as the frame's exposure records it.

   `coefficients` and `covariance` are the frame's estimate, NULL without one; without one and with `still` the light
   stands still from now on. Returns 0, and tells nothing, when the estimate shows another light: that is followed from
   now on. */
EXPORT int follow(FollowedLight *light, const double *coefficients, const double *covariance, const double *exposure,
                  double dt, int still, double *told_coefficients, double *told_covariance)
{
    int64_t count = light->frame->channels * light->frame->size;
    for (int64_t j = 0; still && j < count; j++)
        light->memories[MOVING]->velocity[j] = 0.0;
    for (int m = 0; m < MEMORIES; m++)
        memory_predict(light->memories[m], dt, light->ceiling);
    if (coefficients) {
        relative_take(light->frame, coefficients, covariance, exposure);
        if (!take_in_frame(light, covariance, dt)) {
            start(light, covariance);
            return 0;
        }
    }
    tell(light);
    relative_give(light->told, exposure, light->typical->covariance, told_coefficients, told_covariance);
    return 1;
}
