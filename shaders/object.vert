#version 330
// An object on the sheet: clip position from the CPU (lens distortion included), light from the precomputed transfer.
uniform vec3 eye_mm;
uniform float roughness;
uniform float normal_reflectance;

in vec4 clip;
in vec3 diffuse_radiance;
in vec3 position_mm;
in vec3 normal;
in vec3 base_colour;
#ifdef TEXTURED
in vec3 texture_place;   // u, v, layer
#endif
in vec3 openness_0;      // visibility, real spherical harmonics of the second order
in vec3 openness_1;
in vec3 openness_2;

out vec3 v_body;           // radiance of the matte body before the texture
out vec3 v_view;
out vec3 v_normal;
out float v_openness;
out float v_gloss_albedo;
#ifdef TEXTURED
out vec3 v_texture_place;
#endif

// Directional albedo of the gloss: fit of the split-sum integral by B. Karis, "Physically Based Shading on Mobile" (2014)
float gloss_albedo(float cos_view) {
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a = min(r.x * r.x, exp2(-9.28 * cos_view)) * r.x + r.y;
    vec2 scale_bias = vec2(-1.04, 1.04) * a + r.zw;
    // a matte surface has no grazing reflection either
    float grazing = clamp(50.0 * normal_reflectance, 0.0, 1.0);
    return clamp(normal_reflectance * scale_bias.x + grazing * scale_bias.y, 0.0, 1.0);
}

void main() {
    v_view = normalize(eye_mm - position_mm);
    vec3 r = reflect(-v_view, normal);
    float seen = dot(openness_0, vec3(0.282095, 0.488603 * r.y, 0.488603 * r.z))
               + dot(openness_1, vec3(0.488603 * r.x, 1.092548 * r.x * r.y, 1.092548 * r.y * r.z))
               + dot(openness_2, vec3(0.315392 * (3.0 * r.z * r.z - 1.0), 1.092548 * r.x * r.z,
                                      0.546274 * (r.x * r.x - r.y * r.y)));
    v_openness = clamp(seen, 0.0, 1.0);
    v_gloss_albedo = gloss_albedo(max(dot(v_view, normal), 0.02));
    v_body = base_colour * max(diffuse_radiance, 0.0);
    v_normal = normal;
#ifdef TEXTURED
    v_texture_place = texture_place;
#endif
    gl_Position = clip;
}
