// Culling of strands that the head hides.
//
// Twin of addon/refine/culling.py, which has a figure. Needs the struct DetailView. Holds no
// resources.

// Whether a point lies in the region behind a ball: with s = (point - origin) . axis,
// s >= nearest and |point - origin - s axis|^2 <= width + slope s^2.
bool is_in_region(vec3 point, int index, DetailView detail_view)
{
  vec4 origin_nearest = detail_view.hidden_regions[3 * index];
  vec4 axis_width = detail_view.hidden_regions[3 * index + 1];
  float slope = detail_view.hidden_regions[3 * index + 2].x;
  vec3 away = point - origin_nearest.xyz;
  float along = dot(away, axis_width.xyz);
  vec3 across = away - along * axis_width.xyz;
  return along >= origin_nearest.w && dot(across, across) <= axis_width.w + slope * along * along;
}

// The subset of `regions`, one bit each, that contain a point.
uint regions_around(vec3 point, uint regions, DetailView detail_view)
{
  for (int index = 0; index < int(detail_view.center.w) && regions != 0u; index++) {
    uint region = 1u << uint(index);
    regions &= is_in_region(point, index, detail_view) ? ~0u : ~region;
  }
  return regions;
}

// Whether a strand grows on the far side of the head.
bool faces_away(vec3 root, DetailView detail_view)
{
  vec3 to_eye = detail_view.eye.xyz - detail_view.eye.w * root;
  return dot(root - detail_view.center.xyz, to_eye) < 0.0;
}
