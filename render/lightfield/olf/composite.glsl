// Composite of the layers of a pixel, nearest first: inFrontOf() of reference.h.

vec4 inFrontOf(vec4 nearer, vec4 layer) {
  return layer.a > nearer.a ? nearer + (1.0 - nearer.a / layer.a) * layer : nearer;
}
