#version 330 core
// Distant light in the probe frame, shared by sheet.frag and table.frag, which are appended to this text.
// Two keyed lights, cross-faded linearly.

const float PI = 3.14159265358979;

uniform sampler2D first_environment;   // latitude-longitude radiance, row 0 = zenith
uniform sampler2D second_environment;
uniform float first_yaw_rad;
uniform float second_yaw_rad;
uniform float share;                   // of the second light, 0 to 1

vec3 environment_at(sampler2D map, float yaw_rad, vec3 direction) {
    float azimuth = atan(direction.y, direction.x) - yaw_rad;
    float polar = acos(clamp(direction.z, -1.0, 1.0));
    // level 0: the jump of the azimuth must not look like a small picture of the map
    return textureLod(map, vec2(azimuth / (2.0 * PI), polar / PI), 0.0).rgb;
}

vec3 radiance_from(vec3 direction) {
    vec3 light = environment_at(first_environment, first_yaw_rad, direction);
    if (share > 0.0)
        light = mix(light, environment_at(second_environment, second_yaw_rad, direction), share);
    return light;
}

// Camera: where a pixel's ray goes, probe frame
uniform sampler2D ray_map;             // (x, y) of the undistorted ray (x, y, 1) of every pixel's centre
uniform mat3 probe_from_camera;
uniform vec3 camera_centre_mm;

vec3 ray_through(vec2 normalised) {
    return probe_from_camera * vec3(normalised, 1.0);
}

vec2 normalised_at(ivec2 pixel) {
    return texelFetch(ray_map, pixel, 0).xy;
}
