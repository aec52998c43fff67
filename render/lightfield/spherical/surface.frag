#version 450 core

layout(location = 0) out float distanceAlongAxis;

void main() { distanceAlongAxis = 1.0 / gl_FragCoord.w; }
