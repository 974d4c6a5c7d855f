// The sheet, exact for the light that its paper receives: parallax and refraction of the view, film, Fresnel, the
// environment mirrored in both faces of the glass, and what goes back and forth between them. Appended to
// distant_light.glsl.
// Output: mean radiance of the pixel's part on the sheet times its share, and that share (premultiplied coverage).

uniform vec3 open_irradiance;          // on an upward-facing plane, nothing in front of it
uniform sampler2D film;                // transmittance, 0 under the frame
uniform sampler2D paper;               // reflectance
uniform sampler2D frame;               // (reflectance of the frame, 0 in its window; opening, 1 in its window)
uniform sampler2D first_irradiance;    // of the paper, under the first light
uniform sampler2D second_irradiance;
uniform vec2 sheet_mm;
uniform vec2 irradiance_first_mm;      // outer corner (x, y) of sample [0, 0]
uniform vec2 irradiance_size_mm;
uniform float glass_mm;
uniform float refractive_index;
uniform ivec2 samples;                 // per pixel, across and down
uniform float frame_level;             // mip level that fits the samples' distance

// What is followed one more time through the glass, and then once more: R^2 above these (from 46 and 70 degrees on)
const vec2 FOLLOWED_ROUND_TRIP = vec2(0.0025, 0.03);

out vec4 colour;

float face_reflectance(float cosine) {
    float inside = sqrt(1.0 - (1.0 - cosine * cosine) / (refractive_index * refractive_index));
    float s = (cosine - refractive_index * inside) / (cosine + refractive_index * inside);
    float p = (refractive_index * cosine - inside) / (refractive_index * cosine + inside);
    return 0.5 * (s * s + p * p);
}

vec2 on_sheet(vec2 p_mm) {
    return vec2(p_mm.x / sheet_mm.x + 0.5, 0.5 - p_mm.y / sheet_mm.y);
}

vec3 paper_irradiance(vec2 p_mm) {
    vec2 at = vec2(p_mm.x - irradiance_first_mm.x, irradiance_first_mm.y - p_mm.y) / irradiance_size_mm;
    vec3 irradiance = textureLod(first_irradiance, at, 0.0).rgb;
    if (share > 0.0)
        irradiance = mix(irradiance, textureLod(second_irradiance, at, 0.0).rgb, share);
    return irradiance;
}

// Followed back from where it leaves the film at q: the paper's light comes through the lower face at q - D, where what
// that face mirrors joins it; what the upper face returned at q - 2D crossed the film there twice, and so on. The last
// pass stands for all further ones, as if film and paper went on as they are there.
vec3 leaving_glass(vec2 q_mm, vec2 offset_mm, float round_trip, int passes, vec3 mirrored) {
    vec3 sum = vec3(0.0);
    float passed = textureLod(film, on_sheet(q_mm), 0.0).r;
    vec2 lower_mm = q_mm - offset_mm;
    for (int pass = 0; pass < passes; ++pass) {
        float next_film = textureLod(film, on_sheet(lower_mm - offset_mm), 0.0).r;
        float reflectance = textureLod(paper, on_sheet(lower_mm), 0.0).r;
        float returned = round_trip * next_film * next_film;
        float rest = pass < passes - 1 ? 1.0 : 1.0 / (1.0 - returned);
        sum += passed * rest * (paper_irradiance(lower_mm) * (reflectance / PI) + mirrored * next_film);
        passed *= returned;
        lower_mm -= 2.0 * offset_mm;
    }
    return sum;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    ivec2 last = textureSize(ray_map, 0) - 1;
    vec2 centre = normalised_at(pixel);
    ivec2 left = max(pixel - ivec2(1, 0), ivec2(0)), right = min(pixel + ivec2(1, 0), last);
    ivec2 above = max(pixel - ivec2(0, 1), ivec2(0)), below = min(pixel + ivec2(0, 1), last);
    vec2 across = (normalised_at(right) - normalised_at(left)) / float(max(right.x - left.x, 1));
    vec2 down = (normalised_at(below) - normalised_at(above)) / float(max(below.y - above.y, 1));

    // what changes slowly is taken at the pixel's centre
    vec3 view = -normalize(ray_through(centre));
    float cosine = clamp(view.z, 1e-4, 1.0);
    float face = face_reflectance(cosine);
    float both_faces = (1.0 - face) * (1.0 - face);
    float round_trip = face * face;
    int passes = 1 + int(round_trip > FOLLOWED_ROUND_TRIP.x) + int(round_trip > FOLLOWED_ROUND_TRIP.y);
    vec2 offset_mm = glass_mm * view.xy / sqrt(refractive_index * refractive_index - dot(view.xy, view.xy));
    vec3 mirrored = radiance_from(vec3(-view.xy, view.z));

    vec3 sum = vec3(0.0);
    float inside = 0.0;
    vec2 step_px = 1.0 / vec2(samples);
    for (int row = 0; row < samples.y; ++row) {
        for (int column = 0; column < samples.x; ++column) {
            vec2 at_px = (vec2(column, row) + 0.5) * step_px - 0.5;
            vec3 ray = ray_through(centre + across * at_px.x + down * at_px.y);
            vec2 q_mm = camera_centre_mm.xy - ray.xy * camera_centre_mm.z / ray.z;
            vec2 q = on_sheet(q_mm);
            float covered = float(all(lessThan(abs(q - 0.5), vec2(0.5))) && ray.z < 0.0);
            vec2 printed = textureLod(frame, q, frame_level).rg;
            vec3 upper_mirror = mirrored * face * printed.g;
            vec3 from_glass = both_faces * leaving_glass(q_mm, offset_mm, round_trip, passes, mirrored * face);
            sum += covered * (printed.r * open_irradiance / PI + upper_mirror + from_glass);
            inside += covered;
        }
    }
    float count = float(samples.x * samples.y);
    colour = vec4(sum, inside) / count;
}
