#version 450 core
// Basis stage of a pass: the hat function into alpha.  [Azuma 1999, §2.3]
in float hat;
layout(location = 0) out vec4 radianceWeight;
layout(location = 1) out vec4 observedWeight;

void main() { radianceWeight = observedWeight = vec4(0.0, 0.0, 0.0, hat); }
