#version 330
// Matte body under a dielectric gloss. Radiance is absolute and linear; coverage goes to alpha.
uniform float roughness;
uniform float normal_reflectance;
uniform bool has_texture;
uniform sampler2D gloss;              // octahedral map of lobe-averaged radiance
uniform sampler2DArray base_texture;  // sRGB, decoded here

in vec3 v_body;
in vec3 v_view;
in vec3 v_normal;
in vec3 v_texture_place;
in float v_openness;

out vec4 colour;

vec2 octahedral_place(vec3 d) {
    d /= abs(d.x) + abs(d.y) + abs(d.z);
    vec2 outside = (1.0 - abs(d.yx)) * vec2(d.x >= 0.0 ? 1.0 : -1.0, d.y >= 0.0 ? 1.0 : -1.0);
    return (d.z >= 0.0 ? d.xy : outside) * 0.5 + 0.5;
}

// Directional albedo of the gloss: fit of the split-sum integral by B. Karis, "Physically Based Shading on Mobile" (2014)
float gloss_albedo(float cos_view) {
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a = min(r.x * r.x, exp2(-9.28 * cos_view)) * r.x + r.y;
    vec2 scale_bias = vec2(-1.04, 1.04) * a + r.zw;
    // a matte surface has no grazing reflection either
    float grazing = clamp(50.0 * normal_reflectance, 0.0, 1.0);
    return clamp(normal_reflectance * scale_bias.x + grazing * scale_bias.y, 0.0, 1.0);
}

vec3 linear_from_srgb(vec3 e) {
    return mix(pow((e + 0.055) / 1.055, vec3(2.4)), e / 12.92, vec3(lessThanEqual(e, vec3(0.04045))));
}

void main() {
    vec3 view = normalize(v_view);
    vec3 normal = normalize(gl_FrontFacing ? v_normal : -v_normal);
    float cos_view = max(dot(normal, view), 0.02);
    vec3 body = v_body;
    if (has_texture) body *= linear_from_srgb(texture(base_texture, v_texture_place).rgb);
    float share = gloss_albedo(cos_view);
    vec3 mirrored = max(texture(gloss, octahedral_place(reflect(-view, normal))).rgb, 0.0) * v_openness;
    colour = vec4(body * (1.0 - share) + share * mirrored, 1.0);
}
