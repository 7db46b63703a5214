// Detail factors of a strand as bytes, sixteen to a texel.
//
// A factor is 1 to 64 and unused bytes are 1. Read as floats, such words are normal
// numbers, neither denormal nor NaN, so float textures keep their bits.
// Holds no resources.

const int FACTORS_IN_TEXEL = 16;

// Number of texels for the factors of a strand.
int factor_texels(int cv_count)
{
  return (cv_count - 2) / FACTORS_IN_TEXEL + 1;
}

// Factor `index` of 0..15 of a texel's words.
int unpacked_factor(uvec4 words, int index)
{
  return int((words[index >> 2] >> uint((index & 3) << 3)) & 255u);
}

// Search for the segment in which a station of a strand lies, one texel of factors at a time.
// Stations beyond the tip are clamped to it; the tip belongs to the last piece.
struct StationSearch {
  int station;
  int tip;      // pieces of the strand
  int next;     // station where the next texel's first segment begins
  int segment;  // that segment
  int first;    // station where the found segment begins
  int found;    // the found segment
  int pieces;   // of the found segment
};

StationSearch start_search(int station, int tip)
{
  return StationSearch(min(station, tip), tip, 0, 0, 0, 0, 1);
}

// Search the next sixteen segments: find the word first, then the byte.
void search_factors(inout StationSearch search, vec4 texel)
{
  uvec4 words = floatBitsToUint(texel);
  // byte k of each: the sum of the word's first k + 1 factors, less k + 1, which is 252 at most
  uvec4 sums = (words - 0x01010101u) * 0x01010101u;
  ivec4 pieces = ivec4(sums >> 24u) + 4;
  int begin_y = search.next + pieces.x;
  int begin_z = begin_y + pieces.y;
  int begin_w = begin_z + pieces.z;
  int station = min(search.station, search.tip - 1);
  if (station >= search.next) {
    bool is_y = station >= begin_y, is_z = station >= begin_z, is_w = station >= begin_w;
    uint word = is_w ? words.w : is_z ? words.z : is_y ? words.y : words.x;
    uint sum = is_w ? sums.w : is_z ? sums.z : is_y ? sums.y : sums.x;
    int begin = is_w ? begin_w : is_z ? begin_z : is_y ? begin_y : search.next;
    ivec3 inner = begin + ivec3(1, 2, 3) + (ivec3(uvec3(sum) >> uvec3(0u, 8u, 16u)) & 255);
    bvec3 is_past = greaterThanEqual(ivec3(station), inner);
    int index = is_past.z ? 3 : is_past.y ? 2 : is_past.x ? 1 : 0;
    search.first = is_past.z ? inner.z : is_past.y ? inner.y : is_past.x ? inner.x : begin;
    search.found = search.segment + (is_w ? 12 : is_z ? 8 : is_y ? 4 : 0) + index;
    search.pieces = int((word >> uint(8 * index)) & 255u);
  }
  search.next = begin_w + pieces.w;
  search.segment += FACTORS_IN_TEXEL;
}

// Position of the station within the found segment, 0 to 1.
float found_u(StationSearch search)
{
  return float(search.station - search.first) / float(search.pieces);
}
