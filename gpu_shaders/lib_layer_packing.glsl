// Nodes of the pixels' lists, one for each fragment of a strand: x number of the next node, 0 at the end; y
// depth as float bits; z the strand; w position along its points, in the high 20 bits, and alpha, in the
// low 12.
//
// Holds no resources.

const float LAYER_PLACE = 1048575.0, LAYER_ALPHA = 4095.0;

uint packed_layer(float place, float alpha)
{
  uint steps = uint(clamp(place, 0.0, 1.0) * LAYER_PLACE + 0.5);
  return (steps << 12u) | uint(clamp(alpha, 0.0, 1.0) * LAYER_ALPHA + 0.5);
}

float layer_place(uint word)
{
  return float(word >> 12u) / LAYER_PLACE;
}

float layer_alpha(uint word)
{
  return float(word & 4095u) / LAYER_ALPHA;
}

// Texel of node `number`, counted from 1, in the texture of nodes.
ivec2 layer_texel(uint number)
{
  uint index = number - 1u;
  return ivec2(int(index % uint({{layer_row}})), int(index / uint({{layer_row}})));
}
