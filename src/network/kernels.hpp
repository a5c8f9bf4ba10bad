// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace unirit {

/// What a kernel may use beyond the compiler's baseline. Results may differ in the last bits from
/// one instruction set to another, but not from run to run on the same one.
enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

const char* toString(InstructionSet instruction_set);

/// A fully connected layer as the kernels read it. Outputs stand in panels of the kernels' panel
/// width; those past the layer's own are zero.
struct LayerView {
  const float* panels;  ///< [panel_count][inputs][width]
  const float* bias;    ///< [panel_count * width]
  float floor;          ///< smallest output: 0 for a ReLU, -infinity for none
  long inputs;
  long panel_count;
};

/// Rows of numbers, one row a point, `stride` numbers from row to row.
struct RowsView {
  const float* data;
  long stride;
  long count;
};

/// Oriented points, one coordinate an array, in whole blocks of kPointBlock.
struct OrientedPointsView {
  const float* position[3];
  const float* normal[3];
};

/// Points that a kernel takes together, for every instruction set the same.
inline constexpr long kPointBlock = 16;

/// Room for so many points in whole blocks.
constexpr long inWholeBlocks(long count) {
  return (count + kPointBlock - 1) / kPointBlock * kPointBlock;
}

/// Neighbourhoods of a point, each half the size of the one before, and what is averaged over them.
inline constexpr int kNeighbourhoods = 4;
inline constexpr int kAveraged = 23;

/// What normals do to the attraction between two points.
enum class NormalUse {
  kNone,
  kUnsigned,  ///< factor: the square of their cosine
  kSigned,    ///< the same, but zero where the cosine is negative
};

/// How strongly points attract each other: exp(exponent * squared distance), times what the normals
/// make of it.
struct AffinityView {
  float exponent;  ///< negative
  NormalUse normals;
};

/// The hot loops for one instruction set. Of the dense ones, an output is
/// the bias, then one multiply-add an input in their order: it depends on its own row alone, not on
/// its neighbours or the blocking.
struct Kernels {
  InstructionSet instruction_set;
  int panel_width;  ///< outputs computed together

  /// output[row][first_panel * width ...] = max(floor, weight * input[row] + bias).
  void (*dense)(const LayerView& layer, const RowsView& input, long first_panel, long end_panel,
                float* output, long output_stride);

  /// maxima[o] = max(maxima[o], max over rows of weight * input[row] + bias).
  void (*denseMaximum)(const LayerView& layer, const RowsView& input, float* maxima);

  /// Replaces the lower half of a symmetric matrix, by columns, by that of its Cholesky factor,
  /// whose diagonal is not finite where there is none; what stands above it then means nothing. The
  /// order is a multiple of the panel width.
  void (*cholesky)(float* matrix, long order);

  /// indices[q] = the first of the targets nearest to query q; both are x y z, x y z, ...
  void (*nearest)(const float* queries, long query_count, const float* targets, long target_count,
                  int* indices);

  /// Affinities of one source point (position, normal) to the targets of the blocks named, block
  /// after block; of unsigned use, negative where the normals look to opposite sides. Adds the size
  /// of each to its target's sum and returns the sum over the targets.
  float (*affinities)(const float* source, const OrientedPointsView& targets, const int* blocks,
                      long block_count, const AffinityView& view, float* affinities,
                      float* target_sums);

  /// sums = { sum of w, of w * position, of w * normal } over the targets of the blocks, where w is
  /// the affinity's size times (target weight + source weight); the normals of negative affinities
  /// are reversed.
  void (*gather)(const float* affinities, const OrientedPointsView& targets, const int* blocks,
                 long block_count, const float* target_weights, float source_weight, float* sums);

  /// values[q][j] = e^(exponent * squared distance of query q to target j). Queries are x y z, ...,
  /// targets one coordinate an array, in whole blocks of kPointBlock.
  void (*gaussians)(const float* queries, long query_count, const float* const* targets,
                    long target_count, float exponent, float* values);

  /// Sums over points of their kAveraged values, each weighted by e^(exponent * squared distance to
  /// a query), then by the fourth power of that, the sixteenth ...:
  /// sums[query][kNeighbourhoods][kAveraged]. Queries and points are x y z, x y z, ...
  void (*neighbourhoodSums)(const float* queries, long query_count, const float* points,
                            const float* values, long point_count, float exponent, float* sums);
};

/// What this processor can run, from the baseline up.
std::vector<InstructionSet> supportedInstructionSets();

/// The kernels of the highest supported set, but none above the limit.
const Kernels& selectKernels();

/// For tests: networks built from now on use no higher set than this.
void limitInstructionSet(InstructionSet highest);

}  // namespace unirit
