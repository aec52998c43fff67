#version 450 core
in vec2 scaledHat;
layout(location = 0) out vec4 radianceWeight;
layout(location = 1) out vec4 observedWeight;

void main() { radianceWeight = observedWeight = vec4(0.0, 0.0, 0.0, scaledHat.x / scaledHat.y); }
