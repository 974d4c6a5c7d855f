// The table around the sheet, matte and lit by the whole upper hemisphere; above its horizon, the environment.
// Appended to distant_light.glsl.

uniform vec3 open_irradiance;          // on an upward-facing plane
uniform float table_z_mm;
uniform vec3 table_reflectance;

out vec4 colour;

// Smooth on purpose: a codec spends few bits on it, and the sheet gets them
float grain(vec2 p_mm) {
    vec2 bent = p_mm + vec2(9.0, 5.0) * sin(p_mm.yx / vec2(71.0, 113.0) + vec2(0.4, 1.3));
    float rings = sin(bent.y / 13.0 + 1.6 * sin(bent.x / 97.0) + 0.6 * sin(bent.y / 41.0 + 0.7));
    return 0.5 + 0.5 * rings;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 ray = ray_through(normalised_at(pixel));
    if (ray.z > -1e-4 * length(ray)) {
        colour = vec4(radiance_from(normalize(ray)), 1.0);
        return;
    }
    vec2 p_mm = camera_centre_mm.xy + ray.xy * (table_z_mm - camera_centre_mm.z) / ray.z;
    // a pixel that covers more than a ring shows their mean
    float footprint_mm = 1.0e-3 * (camera_centre_mm.z - table_z_mm) * dot(ray, ray) / (ray.z * ray.z);
    float contrast = 0.22 * exp(-footprint_mm / 10.0);
    vec3 reflectance = table_reflectance * (1.0 + contrast * (grain(p_mm) - 0.5));
    colour = vec4(reflectance * open_irradiance / PI, 1.0);
}
