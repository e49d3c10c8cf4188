/// How far the rays of a frame reach, laid out for those who ask about areas of the image. Internal to
/// algorithms/mapping.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace firstlook {

/// Pixels from (u_low, v_low) to (u_high, v_high), both included.
struct PixelRect {
  int u_low = 0, v_low = 0, u_high = -1, v_high = -1;
  [[nodiscard]] bool empty() const { return u_low > u_high || v_low > v_high; }
};

/// Depth of each ray's end along the optical axis (m), kept in tiles of 8 x 8 pixels, with the farthest and the nearest
/// of each tile, of 2 x 2 tiles, and so on. Memory is taken at construction.
class RangeImage {
 public:
  static constexpr int kTile = 8;
  static constexpr int kTilePixels = kTile * kTile;
  static constexpr float kNoRay = -1;  ///< of pixels without a ray

  RangeImage(int width, int height);
  [[nodiscard]] static std::size_t required_bytes(int width, int height);

  /// A row of pixels; kNoRay for those without a ray. After the last one of a frame: build_levels().
  void set_row(int v, std::span<const float> reach_m);
  void build_levels();

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] int tiles_x() const { return levels_.front().width; }
  [[nodiscard]] float at(int u, int v) const {
    return tile(u / kTile, v / kTile)[static_cast<std::size_t>(v % kTile * kTile + u % kTile)];
  }
  /// All pixels, tile by tile, each row by row.
  [[nodiscard]] std::span<const float> reach_m() const { return reach_m_; }
  [[nodiscard]] std::span<const float> tile(int x, int y) const {
    return std::span(reach_m_).subspan(static_cast<std::size_t>(y * tiles_x() + x) * kTilePixels, kTilePixels);
  }
  /// The farthest of 8 x 8 tiles, row by row; (x, y) counts such blocks. kNoRay where the image has no tile.
  [[nodiscard]] std::span<const float> block(int x, int y) const {
    return std::span(tile_farthest_m_).subspan(static_cast<std::size_t>(y * blocks_x_ + x) * kTilePixels, kTilePixels);
  }
  [[nodiscard]] float farthest() const { return levels_.back().at(0, 0).farthest; }

  struct Bounds {
    float nearest = kNoRay;   ///< kNoRay when any pixel has no ray
    float farthest = kNoRay;  ///< kNoRay when none has one
  };
  /// Bounds of what the rays inside a rectangle reach, from at most nine tiles that cover it: not the tightest.
  [[nodiscard]] Bounds bounds(const PixelRect& rect) const;

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<Bounds> tiles;
    [[nodiscard]] const Bounds& at(int x, int y) const {
      return tiles[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
    }
  };
  int width_, height_;
  std::vector<float> reach_m_;
  int blocks_x_ = 0;
  std::vector<float> tile_farthest_m_;
  std::vector<Level> levels_;
};

}  // namespace firstlook
