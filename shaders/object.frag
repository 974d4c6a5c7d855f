#version 330
// Matte body under a dielectric gloss. Radiance is absolute and linear; coverage goes to alpha.
uniform sampler2D gloss;              // octahedral map of lobe-averaged radiance

in vec3 v_body;
in vec3 v_view;
in vec3 v_normal;
in float v_openness;
in float v_gloss_albedo;

out vec4 colour;

vec2 octahedral_place(vec3 d) {
    d /= abs(d.x) + abs(d.y) + abs(d.z);
    vec2 outside = (1.0 - abs(d.yx)) * vec2(d.x >= 0.0 ? 1.0 : -1.0, d.y >= 0.0 ? 1.0 : -1.0);
    return (d.z >= 0.0 ? d.xy : outside) * 0.5 + 0.5;
}

#ifdef TEXTURED
uniform sampler2DArray base_texture;  // sRGB, decoded here

in vec3 v_texture_place;

vec3 linear_from_srgb(vec3 e) {
    return mix(pow((e + 0.055) / 1.055, vec3(2.4)), e / 12.92, vec3(lessThanEqual(e, vec3(0.04045))));
}
#endif

void main() {
    vec3 normal = normalize(gl_FrontFacing ? v_normal : -v_normal);
    vec3 body = v_body;
#ifdef TEXTURED
    body *= linear_from_srgb(texture(base_texture, v_texture_place).rgb);
#endif
    vec3 mirrored = max(texture(gloss, octahedral_place(reflect(-normalize(v_view), normal))).rgb, 0.0) * v_openness;
    colour = vec4(mix(body, mirrored, v_gloss_albedo), 1.0);
}
