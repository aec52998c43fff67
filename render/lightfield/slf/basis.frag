#version 450 core
in float hat;
layout(location = 0) out vec4 radianceWeight;
layout(location = 1) out vec4 observedWeight;

void main() { radianceWeight = observedWeight = vec4(0.0, 0.0, 0.0, hat); }
