// The state of one guide in a compute shader invocation. Each array has one entry per CV, free CV or
// segment, and all loops have constant bounds, so that compilers keep arrays in registers. Mesa unrolls a
// loop of any length if its count is the length of an array in it: a loop of FREE_COUNT rounds needs an
// array of FREE_SIZE, or compiling for 32 CVs takes minutes.
//
// Twin of addon/dynamics/state.py. Defines: CV_COUNT, at least 2; HAS_HELD, where CVs are held by
// ties; HAS_SPRINGS, where curls stretch. Holds no resources.

#define PINNED_COUNT {{pinned_count}}
#define FREE_COUNT (CV_COUNT - PINNED_COUNT)
#define FREE_SIZE (FREE_COUNT > 0 ? FREE_COUNT : 1)
#define TINY 1.0e-12

vec3 position[CV_COUNT];       // world [m]
vec3 previous[CV_COUNT];       // the same a substep earlier
vec3 style[CV_COUNT];          // where the head carries each CV at the substep's end
vec3 style_twist;              // the same for the CV that defines the twist about the root
vec4 shape[FREE_SIZE];         // of CV i + 1: xyz curvature at rest [m], w its turning fraction
float segment_length[FREE_SIZE];  // [m] from CV i + 1 to CV i + 2
// the same for all guides; copied here because some drivers are slow at arrays in uniform blocks
vec4 band[FREE_SIZE];          // of free CV i: near and far factor, inverse pivot, global stiffness
float local_stiffness[FREE_SIZE];  // of CV i + 1
float radius[FREE_SIZE];       // of free CV i [m], in collisions
#ifdef HAS_HELD
bool held[FREE_SIZE];  // of free CV i; twin of addon/dynamics/held.py
#endif

#ifdef HAS_SPRINGS
float rest_length[FREE_SIZE];  // [m] at rest; segment_length is that of this substep
float max_extension[FREE_SIZE];  // [m] of segment i, 0 where it cannot stretch
float load[FREE_SIZE];         // [m] by which the style's own weight would stretch it
float compliance[FREE_SIZE];   // of segment i in the next Newton step
#define LENGTH_AT_REST rest_length
#else
#define LENGTH_AT_REST segment_length
#endif

// Length of a vector, never zero; the added term is lost to rounding above 1e-8 m.
float length_of(vec3 vector)
{
  return sqrt(dot(vector, vector) + TINY * TINY);
}

vec3 unit_of(vec3 vector)
{
  return vector / length_of(vector);
}

// Element of an array at an index unknown at compile time, which as a plain access would force the array
// into memory. With next_set, code that is long or branches is compiled once instead of once per CV, which
// would take drivers a minute.
vec3 element_at(vec3 list[CV_COUNT], int index)
{
  vec3 found = list[0];
  for (int k = 1; k < CV_COUNT; k++) {
    found = k == index ? list[k] : found;
  }
  return found;
}

float element_at(float list[FREE_SIZE], int index)
{
  float found = list[0];
  for (int k = 1; k < FREE_COUNT; k++) {
    found = k == index ? list[k] : found;
  }
  return found;
}

// The first free CV or segment after `index` that is set; FREE_COUNT for none.
int next_set(bool is_set[FREE_SIZE], int index)
{
  int next = FREE_COUNT;
  for (int k = FREE_COUNT - 1; k >= 0; k--) {
    next = is_set[k] && k > index ? k : next;
  }
  return next;
}
