#version 330
// An object on the sheet: clip position from the CPU (lens distortion included), light from the precomputed transfer.
uniform vec3 eye_mm;

in vec4 clip;
in vec3 diffuse_radiance;
in vec3 position_mm;
in vec3 normal;
in vec3 base_colour;
in vec3 texture_place;   // u, v, layer
in vec3 openness_0;      // visibility, real spherical harmonics of the second order
in vec3 openness_1;
in vec3 openness_2;

out vec3 v_body;           // radiance of the matte body before the texture
out vec3 v_view;
out vec3 v_normal;
out vec3 v_texture_place;
out float v_openness;

void main() {
    v_view = normalize(eye_mm - position_mm);
    vec3 r = reflect(-v_view, normal);
    float seen = dot(openness_0, vec3(0.282095, 0.488603 * r.y, 0.488603 * r.z))
               + dot(openness_1, vec3(0.488603 * r.x, 1.092548 * r.x * r.y, 1.092548 * r.y * r.z))
               + dot(openness_2, vec3(0.315392 * (3.0 * r.z * r.z - 1.0), 1.092548 * r.x * r.z,
                                      0.546274 * (r.x * r.x - r.y * r.y)));
    v_openness = clamp(seen, 0.0, 1.0);
    v_body = base_colour * max(diffuse_radiance, 0.0);
    v_normal = normal;
    v_texture_place = texture_place;
    gl_Position = clip;
}
