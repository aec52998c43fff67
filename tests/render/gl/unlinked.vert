#version 450 core
void place();

void main() { place(); }
