float halved(float x) { return 0.5 * x; }
float twice(float x) { return 2.0 * y; }
