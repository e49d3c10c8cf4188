#include "algorithms/mapping/range_image.hpp"

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr int kAcrossMax = 3;  // tiles of a level that bounds() looks at along each axis

int tiles_for(int pixels) { return (pixels + RangeImage::kTile - 1) / RangeImage::kTile; }

}  // namespace

RangeImage::RangeImage(int width, int height) : width_(width), height_(height) {
  ENSURE(3046, width > 0 && height > 0);
  Level level{tiles_for(width), tiles_for(height), {}};
  blocks_x_ = tiles_for(level.width);
  tile_farthest_m_.assign(static_cast<std::size_t>(blocks_x_ * tiles_for(level.height)) * kTilePixels, kNoRay);
  reach_m_.assign(static_cast<std::size_t>(level.width * level.height) * kTilePixels, kNoRay);
  while (true) {
    level.tiles.assign(static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height), {});
    levels_.push_back(level);
    if (level.width == 1 && level.height == 1) break;
    level.width = (level.width + 1) / 2;
    level.height = (level.height + 1) / 2;
  }
}

std::size_t RangeImage::required_bytes(int width, int height) {
  const auto tiles = static_cast<std::size_t>(tiles_for(width)) * static_cast<std::size_t>(tiles_for(height));
  return tiles * (kTilePixels * sizeof(float) + 2 * sizeof(Bounds));  // the levels above are less than as much again
}

void RangeImage::set_row(int v, std::span<const float> reach_m) {
  float* out = reach_m_.data() + static_cast<std::size_t>((v / kTile) * tiles_x()) * kTilePixels + (v % kTile) * kTile;
  std::size_t u = 0;
  for (; u + kTile <= reach_m.size(); u += kTile, out += kTilePixels) std::copy_n(reach_m.data() + u, kTile, out);
  std::copy(reach_m.begin() + static_cast<std::ptrdiff_t>(u), reach_m.end(), out);
}

void RangeImage::build_levels() {
  Level& lowest = levels_.front();
  for (std::size_t t = 0; t < lowest.tiles.size(); ++t) {
    const float* pixels = reach_m_.data() + t * kTilePixels;
    // Eight running bounds, one for each column: no order of comparisons matters, so they may run side by side.
    float near[kTile], far[kTile];
    for (int c = 0; c < kTile; ++c) near[c] = far[c] = pixels[c];
    for (int i = kTile; i < kTilePixels; i += kTile) {
      for (int c = 0; c < kTile; ++c) near[c] = std::min(near[c], pixels[i + c]);
      for (int c = 0; c < kTile; ++c) far[c] = std::max(far[c], pixels[i + c]);
    }
    const int x = static_cast<int>(t) % lowest.width, y = static_cast<int>(t) / lowest.width;
    const Bounds& bounds =
        lowest.tiles[t] = {*std::min_element(near, near + kTile), *std::max_element(far, far + kTile)};
    tile_farthest_m_[static_cast<std::size_t>((y / kTile) * blocks_x_ + x / kTile) * kTilePixels +
                     static_cast<std::size_t>((y % kTile) * kTile + x % kTile)] = bounds.farthest;
  }
  for (std::size_t l = 1; l < levels_.size(); ++l) {
    const Level& below = levels_[l - 1];
    for (int y = 0; y < levels_[l].height; ++y) {
      for (int x = 0; x < levels_[l].width; ++x) {
        Bounds both = below.at(2 * x, 2 * y);
        for (int dy = 0; dy < 2; ++dy) {
          for (int dx = 0; dx < 2; ++dx) {
            if (2 * x + dx >= below.width || 2 * y + dy >= below.height) continue;
            const Bounds& part = below.at(2 * x + dx, 2 * y + dy);
            both = {std::min(both.nearest, part.nearest), std::max(both.farthest, part.farthest)};
          }
        }
        levels_[l].tiles[static_cast<std::size_t>(y) * static_cast<std::size_t>(levels_[l].width) +
                         static_cast<std::size_t>(x)] = both;
      }
    }
  }
}

RangeImage::Bounds RangeImage::bounds(const PixelRect& rect) const {
  if (rect.empty()) return {};
  int size = kTile;
  std::size_t l = 0;
  while (rect.u_high / size - rect.u_low / size >= kAcrossMax || rect.v_high / size - rect.v_low / size >= kAcrossMax) {
    size *= 2;
    ++l;
  }
  const Level& level = levels_[l];
  Bounds all = level.at(rect.u_low / size, rect.v_low / size);
  for (int y = rect.v_low / size; y <= rect.v_high / size; ++y) {
    for (int x = rect.u_low / size; x <= rect.u_high / size; ++x) {
      const Bounds& part = level.at(x, y);
      all = {std::min(all.nearest, part.nearest), std::max(all.farthest, part.farthest)};
    }
  }
  return all;
}

}  // namespace firstlook
