#version 330
// Parallel projection along one light direction; depth 0 is nearest to the light.
uniform mat4 clip_from_probe;
in vec3 position;

void main() {
    gl_Position = clip_from_probe * vec4(position, 1.0);
}
