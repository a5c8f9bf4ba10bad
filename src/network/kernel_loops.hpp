// SPDX-License-Identifier: BSD-3-Clause
// The kernels' one source, included by one translation unit for each instruction set. Nothing of
// the standard library or Eigen may be used here: the linker would merge one instruction set's copy
// of an inline function into the code of the others.
#pragma once

#include "kernels.hpp"

namespace unirit {
namespace {

/// `Lanes` floats to a register; register tiles of `TileRows` rows by `Vectors` registers.
template <int Lanes, int TileRows, int Vectors>
struct Loops {
  typedef float Vector __attribute__((vector_size(Lanes * 4)));
  typedef int IndexVector __attribute__((vector_size(Lanes * 4)));
  typedef unsigned BitVector __attribute__((vector_size(Lanes * 4)));
  static constexpr int kWidth = Lanes * Vectors;
  static constexpr int kColumns = 4;  // of a matrix that are factored together
  static_assert(kWidth % kColumns == 0);

  static Vector load(const float* from) {
    Vector vector;
    __builtin_memcpy(&vector, from, sizeof(vector));
    return vector;
  }

  static void store(const Vector& vector, float* to) {
    __builtin_memcpy(to, &vector, sizeof(vector));
  }

  template <int Rows>
  static inline __attribute__((always_inline)) void accumulate(const float* input, long stride,
                                                               const float* panel, long inputs,
                                                               const float* bias,
                                                               Vector (&sums)[Rows][Vectors]) {
#pragma GCC unroll 16
    for (int row = 0; row < Rows; ++row) {
#pragma GCC unroll 4
      for (int v = 0; v < Vectors; ++v) {
        sums[row][v] = load(bias + v * Lanes);
      }
    }
    for (long k = 0; k < inputs; ++k) {
      Vector weights[Vectors];
#pragma GCC unroll 4
      for (int v = 0; v < Vectors; ++v) {
        weights[v] = load(panel + k * kWidth + v * Lanes);
      }
#pragma GCC unroll 16
      for (int row = 0; row < Rows; ++row) {
#pragma GCC unroll 4
        for (int v = 0; v < Vectors; ++v) {
          sums[row][v] += input[row * stride + k] * weights[v];
        }
      }
    }
  }

  /// Writes the tiles of one panel for `rows` rows, in tiles of `Rows`, the rest in smaller ones.
  template <int Rows>
  static void densePanel(const LayerView& layer, RowsView input, long panel, float* output,
                         long output_stride) {
    const float* bias = layer.bias + panel * kWidth;
    const float* weights = layer.panels + panel * kWidth * layer.inputs;
    const Vector floor = layer.floor - Vector{};
    for (; input.count >= Rows; input.count -= Rows) {
      Vector sums[Rows][Vectors];
      accumulate<Rows>(input.data, input.stride, weights, layer.inputs, bias, sums);
#pragma GCC unroll 16
      for (int row = 0; row < Rows; ++row) {
#pragma GCC unroll 4
        for (int v = 0; v < Vectors; ++v) {
          store(sums[row][v] > floor ? sums[row][v] : floor,
                output + row * output_stride + panel * kWidth + v * Lanes);
        }
      }
      input.data += Rows * input.stride;
      output += Rows * output_stride;
    }
    if constexpr (Rows > 1) {
      densePanel<Rows / 2>(layer, input, panel, output, output_stride);
    }
  }

  /// As densePanel, but keeps only the largest output over the rows.
  template <int Rows>
  static void maximumPanel(const LayerView& layer, RowsView input, long panel, float* maxima) {
    const float* bias = layer.bias + panel * kWidth;
    const float* weights = layer.panels + panel * kWidth * layer.inputs;
    for (; input.count >= Rows; input.count -= Rows) {
      Vector sums[Rows][Vectors];
      accumulate<Rows>(input.data, input.stride, weights, layer.inputs, bias, sums);
#pragma GCC unroll 4
      for (int v = 0; v < Vectors; ++v) {
        float* maximum = maxima + panel * kWidth + v * Lanes;
        Vector largest = load(maximum);
#pragma GCC unroll 16
        for (int row = 0; row < Rows; ++row) {
          largest = sums[row][v] > largest ? sums[row][v] : largest;
        }
        store(largest, maximum);
      }
      input.data += Rows * input.stride;
    }
    if constexpr (Rows > 1) {
      maximumPanel<Rows / 2>(layer, input, panel, maxima);
    }
  }

  static void dense(const LayerView& layer, const RowsView& input, long first_panel, long end_panel,
                    float* output, long output_stride) {
    for (long panel = first_panel; panel < end_panel; ++panel) {
      densePanel<TileRows>(layer, input, panel, output, output_stride);
    }
  }

  static void denseMaximum(const LayerView& layer, const RowsView& input, float* maxima) {
    for (long panel = 0; panel < layer.panel_count; ++panel) {
      maximumPanel<TileRows>(layer, input, panel, maxima);
    }
  }

  /// By columns, kColumns together: less what the columns before them explain, then one by the
  /// other. What stands above the diagonal is carried along and enters nothing below it.
  static void cholesky(float* matrix, long order) {
    for (long first = 0; first < order; first += kColumns) {
      const long top = first / kWidth * kWidth;
      for (long row = top; row < order; row += kWidth) subtractBefore(matrix, order, first, row);
      for (long column = first; column < first + kColumns; ++column) {
        float* factor = matrix + column * order;
        const Vector scale = 1.0F / __builtin_sqrtf(factor[column]) - Vector{};
        for (long row = top; row < order; row += Lanes) {
          const Vector scaled = load(factor + row) * scale;
          store(scaled, factor + row);
        }
        for (long later = column + 1; later < first + kColumns; ++later) {
          subtractColumn(factor, top, order, factor[later], matrix + later * order);
        }
      }
    }
  }

  static void subtractColumn(const float* factor, long top, long order, float share,
                             float* column) {
    for (long row = top; row < order; row += Lanes) {
      store(load(column + row) - load(factor + row) * share, column + row);
    }
  }

  /// What the columns before them explain, from kWidth rows of kColumns columns.
  static void subtractBefore(float* matrix, long order, long first, long row) {
    float* columns = matrix + first * order + row;
    Vector sums[kColumns][Vectors];
    for (int c = 0; c < kColumns; ++c) {
      for (int v = 0; v < Vectors; ++v) sums[c][v] = load(columns + c * order + v * Lanes);
    }
    for (long before = 0; before < first; ++before) {
      const float* factor = matrix + before * order;
      for (int v = 0; v < Vectors; ++v) {
        const Vector rows = load(factor + row + v * Lanes);
#pragma GCC unroll 4
        for (int c = 0; c < kColumns; ++c) sums[c][v] -= rows * factor[first + c];
      }
    }
    for (int c = 0; c < kColumns; ++c) {
      for (int v = 0; v < Vectors; ++v) store(sums[c][v], columns + c * order + v * Lanes);
    }
  }

  /// x, y and z of up to as many queries as there are lanes; the rest are zero.
  static void loadQueries(const float* queries, long count, Vector (&coordinates)[3]) {
    float lanes[3][Lanes] = {};
    for (long lane = 0; lane < count; ++lane) {
      for (int axis = 0; axis < 3; ++axis) lanes[axis][lane] = queries[3 * lane + axis];
    }
    for (int axis = 0; axis < 3; ++axis) coordinates[axis] = load(lanes[axis]);
  }

  /// Exhaustive, one query a lane: at a thousand targets faster than a k-d tree.
  static void nearest(const float* queries, long query_count, const float* targets,
                      long target_count, int* indices) {
    for (long begin = 0; begin < query_count; begin += Lanes) {
      const long lanes = query_count - begin < Lanes ? query_count - begin : Lanes;
      Vector query[3];
      loadQueries(queries + 3 * begin, lanes, query);
      Vector smallest = __builtin_inff() - Vector{};
      IndexVector index{};
      for (long target = 0; target < target_count; ++target) {
        const Vector dx = query[0] - targets[3 * target];
        const Vector dy = query[1] - targets[3 * target + 1];
        const Vector dz = query[2] - targets[3 * target + 2];
        const Vector distance = dx * dx + dy * dy + dz * dz;
        const IndexVector closer = distance < smallest;
        smallest = closer ? distance : smallest;
        index = closer ? static_cast<int>(target) - IndexVector{} : index;
      }
      __builtin_memcpy(indices + begin, &index, static_cast<unsigned long>(lanes) * sizeof(int));
    }
  }

  /// 2^x for x <= 0, to a relative 2e-7; zero below -125.55. By 2^x = 2^n 2^f, |f| <= 1/2, and the
  /// polynomial that is exact at zero and else closest to 2^f.
  static Vector powerOfTwo(Vector x) {
    // Adding 1.5 * 2^23 rounds to a whole number, which then stands in the low bits
    const Vector shifted = x + 12582912.0F;
    const Vector f = x - (shifted - 12582912.0F);
    const Vector series =
        1.0F +
        f * (0.693147004F +
             f * (0.240222424F + f * (0.0555073359F + f * (0.00967151299F + f * 0.00132647273F))));
    BitVector n, bits;
    __builtin_memcpy(&n, &shifted, sizeof(n));
    __builtin_memcpy(&bits, &series, sizeof(bits));
    bits += n << 23;  // into the exponent
    Vector power;
    __builtin_memcpy(&power, &bits, sizeof(power));
    return x < -125.55F - Vector{} ? Vector{} : power;
  }

  /// e^(exponent * squared distance); the rounding of their product leaves it a relative 5e-6.
  static Vector gaussian(float exponent, Vector squared_distance) {
    constexpr float kLog2E = 1.44269504F;
    return powerOfTwo(kLog2E * exponent * squared_distance);
  }

  /// Affinities of one source point to the targets from j on.
  static Vector affinity(const float* source, const OrientedPointsView& targets, long j,
                         const AffinityView& view) {
    const Vector dx = load(targets.position[0] + j) - source[0];
    const Vector dy = load(targets.position[1] + j) - source[1];
    const Vector dz = load(targets.position[2] + j) - source[2];
    const Vector closeness = gaussian(view.exponent, dx * dx + dy * dy + dz * dz);
    if (view.normals == NormalUse::kNone) return closeness;
    const Vector cosine = load(targets.normal[0] + j) * source[3] +
                          load(targets.normal[1] + j) * source[4] +
                          load(targets.normal[2] + j) * source[5];
    if (view.normals == NormalUse::kUnsigned) return closeness * cosine * absolute(cosine);
    return cosine > 0.0F ? closeness * cosine * cosine : Vector{};
  }

  static Vector absolute(Vector vector) {
    IndexVector bits;
    __builtin_memcpy(&bits, &vector, sizeof(bits));
    bits &= 0x7FFFFFFF;
    __builtin_memcpy(&vector, &bits, sizeof(bits));
    return vector;
  }

  static float sum(const Vector& vector) {
    float lanes[Lanes];
    store(vector, lanes);
#pragma GCC unroll 4
    for (int half = Lanes / 2; half > 0; half /= 2) {
#pragma GCC unroll 8
      for (int lane = 0; lane < half; ++lane) lanes[lane] += lanes[lane + half];
    }
    return lanes[0];
  }

  static float affinities(const float* source, const OrientedPointsView& targets, const int* blocks,
                          long block_count, const AffinityView& view, float* affinities,
                          float* target_sums) {
    Vector total{};
    for (long b = 0; b < block_count; ++b) {
      for (long j = blocks[b] * kPointBlock; j < (blocks[b] + 1) * kPointBlock; j += Lanes) {
        const Vector value = affinity(source, targets, j, view);
        store(value, affinities);
        store(load(target_sums + j) + absolute(value), target_sums + j);
        total += absolute(value);
        affinities += Lanes;
      }
    }
    return sum(total);
  }

  static void gather(const float* affinities, const OrientedPointsView& targets, const int* blocks,
                     long block_count, const float* target_weights, float source_weight,
                     float* sums) {
    Vector totals[7] = {};
    for (long b = 0; b < block_count; ++b) {
      for (long j = blocks[b] * kPointBlock; j < (blocks[b] + 1) * kPointBlock; j += Lanes) {
        const Vector turned = load(affinities) * (load(target_weights + j) + source_weight);
        const Vector weight = absolute(turned);
        totals[0] += weight;
        for (int axis = 0; axis < 3; ++axis) {
          totals[1 + axis] += weight * load(targets.position[axis] + j);
          totals[4 + axis] += turned * load(targets.normal[axis] + j);
        }
        affinities += Lanes;
      }
    }
    for (int k = 0; k < 7; ++k) sums[k] = sum(totals[k]);
  }

  static void gaussians(const float* queries, long query_count, const float* const* targets,
                        long target_count, float exponent, float* values) {
    for (long q = 0; q < query_count; ++q) {
      const float* query = queries + 3 * q;
      for (long j = 0; j < target_count; j += Lanes) {
        const Vector dx = load(targets[0] + j) - query[0];
        const Vector dy = load(targets[1] + j) - query[1];
        const Vector dz = load(targets[2] + j) - query[2];
        store(gaussian(exponent, dx * dx + dy * dy + dz * dz), values + q * target_count + j);
      }
    }
  }

  /// One query a lane, as in `nearest`. Some points at a time, so that the sums of one size stay in
  /// registers over them.
  static void neighbourhoodSums(const float* queries, long query_count, const float* points,
                                const float* values, long point_count, float exponent,
                                float* sums) {
    constexpr long kTile = 64;
    Vector weights[kNeighbourhoods][kTile];
    for (long begin = 0; begin < query_count; begin += Lanes) {
      const long lanes = query_count - begin < Lanes ? query_count - begin : Lanes;
      Vector query[3];
      loadQueries(queries + 3 * begin, lanes, query);
      Vector totals[kNeighbourhoods][kAveraged] = {};
      for (long first = 0; first < point_count; first += kTile) {
        const long tile = point_count - first < kTile ? point_count - first : kTile;
        for (long i = 0; i < tile; ++i) {
          const float* point = points + 3 * (first + i);
          const Vector dx = query[0] - point[0];
          const Vector dy = query[1] - point[1];
          const Vector dz = query[2] - point[2];
          Vector weight = gaussian(exponent, dx * dx + dy * dy + dz * dz);
          for (int size = 0; size < kNeighbourhoods; ++size) {
            weights[size][i] = weight;
            weight *= weight;
            weight *= weight;
          }
        }
        for (int size = 0; size < kNeighbourhoods; ++size) {
          addWeighted(weights[size], values + kAveraged * first, tile, totals[size]);
        }
      }
      float stored[kNeighbourhoods * kAveraged][Lanes];
      for (int k = 0; k < kNeighbourhoods * kAveraged; ++k) {
        store(totals[k / kAveraged][k % kAveraged], stored[k]);
      }
      for (long lane = 0; lane < lanes; ++lane) {
        for (int k = 0; k < kNeighbourhoods * kAveraged; ++k) *sums++ = stored[k][lane];
      }
    }
  }

  static void addWeighted(const Vector* weights, const float* values, long count, Vector* totals) {
    Vector sum[kAveraged];
    for (int k = 0; k < kAveraged; ++k) sum[k] = totals[k];
    for (long i = 0; i < count; ++i) {
#pragma GCC unroll kAveraged
      for (int k = 0; k < kAveraged; ++k) sum[k] += weights[i] * values[kAveraged * i + k];
    }
    for (int k = 0; k < kAveraged; ++k) totals[k] = sum[k];
  }

  static constexpr Kernels kernels(InstructionSet instruction_set) {
    return {instruction_set, kWidth,     dense,  denseMaximum, cholesky,
            nearest,         affinities, gather, gaussians,    neighbourhoodSums};
  }
};

}  // namespace
}  // namespace unirit
