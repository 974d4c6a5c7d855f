#version 330 core
// Polygons given in pixels of the image: pixel centres at integers, y down. Row 0 of the image is row 0 of the buffer.

in vec2 position_px;
uniform vec2 image_size_px;

void main() {
    gl_Position = vec4((position_px + 0.5) / image_size_px * 2.0 - 1.0, 0.0, 1.0);
}
