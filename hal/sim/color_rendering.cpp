#include "hal/sim/color_rendering.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "algorithms/vision/target_pattern.hpp"
#include "hal/sim/body_image.hpp"
#include "hal/sim/pixel_noise.hpp"
#include "hal/sim/row_bands.hpp"

namespace firstlook::sim {
namespace {

using Eigen::Vector3d;

constexpr float kWhite = 0.85F, kBlack = 0.06F;  // printed paper
constexpr double kGrayOfFullLight = 255;
constexpr float kBlurSigma_px = 0.6F;  // of lens and sensor together, a webcam in focus
constexpr float kNoiseSigma = 2.0F;    // grey levels
constexpr float kBodyReflectance = 0.55F;
constexpr std::uint64_t kGrayNoise = 2, kSampleJitter = 3, kColorNoise = 16;  // the last three: one for each colour
constexpr int kBoardSamples = 8;   // in each direction, where a pixel sees nothing but the board: by formula
constexpr int kTracedSamples = 4;  // in each direction, at other edges: rays

// What a pixel sees; edges are where neighbours see different things.
constexpr std::int32_t kNothing = -1, kBody = -2;
constexpr std::int32_t kFaces = 8;  // for each solid: 0..5 its sides by normal, 6 and 7 the light and dark of the board
constexpr std::int32_t kLight = 6, kDark = 7;

struct Sample {
  float gray = 0;
  std::int32_t seen = kNothing;
};

class ColorFrame {
 public:
  ColorFrame(const Scene& scene, const RayTracer& tracer, const PixelRays& rays,
             const Transform<Base, Camera>& base_T_camera, const Exposure& exposure, Channel channel,
             WorkerPool* workers)
      : channel_(channel),
        scene_(scene),
        tracer_(tracer),
        rays_(rays),
        workers_(workers),
        base_T_camera_(base_T_camera.pose()),
        body_(exposure.body, base_T_camera_, base_T_camera.translation()),
        noise_(exposure.seed, exposure.frame,
               channel == Channel::kGray ? kGrayNoise : kColorNoise + static_cast<std::uint64_t>(channel)),
        jitter_(exposure.seed, exposure.frame, kSampleJitter),
        gray_(rays.x.size()),
        seen_(rays.x.size()) {
    for (const BoardPlacement& board : scene.boards) {
      boards_.push_back(
          {board, (board.base_T_board.inverse() * base_T_camera).pose(), -board.base_T_board.rotation().col(2)});
    }
  }

  void render(MutableGrayImage out) {
    trace_centers();
    resample_edges();
    blur();
    for_rows([&](int r) {
      for (std::size_t i = rays_.index(0, r), end = rays_.index(0, r + 1); i < end; ++i) {
        const float noisy = gray_[i] + kNoiseSigma * normal_of(noise_.bits(i));
        out.data[i] = static_cast<std::uint8_t>(std::clamp(std::floor(noisy + 0.5F), 0.0F, 255.0F));
      }
    });
  }

 private:
  /// A board as the camera has it.
  struct SeenBoard {
    const BoardPlacement& placed;
    Pose board_T_camera;
    Vector3d normal;  ///< towards who looks at it

    /// Where the ray (x, y, 1) meets its plane, in board coordinates.
    [[nodiscard]] Vector3d meet(double x, double y) const {
      const Vector3d d = board_T_camera.linear() * Vector3d(x, y, 1);
      return board_T_camera.translation() - board_T_camera.translation().z() / d.z() * d;
    }
  };

  template <typename Body>
  void for_rows(Body body) const {
    for_row_bands(workers_, rays_.camera.height, [&](int first, int last) {
      for (int r = first; r < last; ++r) body(r);
    });
  }

  void aim(RayRow& row, std::size_t i, double x, double y) const {
    const Vector3d d = base_T_camera_.linear() * Vector3d(x, y, 1);
    row.x[i] = static_cast<float>(d.x()), row.y[i] = static_cast<float>(d.y()), row.z[i] = static_cast<float>(d.z());
  }

  void trace_centers() {
    for_row_bands(workers_, rays_.camera.height, [&](int first_row, int last_row) {
      RayRow row(static_cast<std::size_t>(rays_.camera.width));
      for (int r = first_row; r < last_row; ++r) {
        const std::size_t first = rays_.index(0, r);
        const auto [low, high] = std::ranges::minmax(std::span(rays_.y).subspan(first, row.size()));
        const BodyImage body = body_.band(low, high);
        for (std::size_t i = 0; i < row.size(); ++i) aim(row, i, rays_.x[first + i], rays_.y[first + i]);
        tracer_.trace(base_T_camera_.translation(), row, row.size());
        for (std::size_t i = 0; i < row.size(); ++i) {
          const Sample sample = look(body, row, i, rays_.x[first + i], rays_.y[first + i]);
          gray_[first + i] = sample.gray;
          seen_[first + i] = sample.seen;
        }
      }
    });
  }

  [[nodiscard]] const SeenBoard* board_of(std::size_t solid) const {
    const auto found = std::ranges::find_if(boards_, [&](const SeenBoard& b) { return b.placed.solid == solid; });
    return found == boards_.end() ? nullptr : &*found;
  }

  [[nodiscard]] Sample look_at_board(const SeenBoard& board, double x, double y) const {
    const Vector3d at = board.meet(x, y);
    const float reflectance = board_reflectance(board.placed, at.x(), at.y());
    const Vector3d point = board.placed.base_T_board * at;
    return {brightness(reflectance, point, board.normal),
            static_cast<std::int32_t>(board.placed.solid) * kFaces + (reflectance == kBlack ? kDark : kLight)};
  }

  [[nodiscard]] float reflectance(const Surface& surface) const {
    return channel_ == Channel::kGray ? surface.gray() : surface.color[static_cast<std::size_t>(channel_)];
  }

  [[nodiscard]] float brightness(double reflectance, const Vector3d& point, const Vector3d& normal) const {
    return static_cast<float>(kGrayOfFullLight * shade(scene_.light, reflectance, point, normal));
  }

  /// What ray i of the row, which is (x, y, 1) of the camera, has met.
  [[nodiscard]] Sample look(const BodyImage& body, const RayRow& row, std::size_t i, double x, double y) const {
    BodyHit hit;
    if (body.intersect(x, y, row.t[i], hit)) {
      const Vector3d point = base_T_camera_ * Vector3d(hit.depth_m * Vector3d(x, y, 1));
      return {brightness(kBodyReflectance, point, base_T_camera_.linear() * hit.normal), kBody};
    }
    if (row.solid[i] < 0) return {};
    const auto solid = static_cast<std::size_t>(row.solid[i]);
    const Vector3d normal(row.nx[i], row.ny[i], row.nz[i]);
    const SeenBoard* board = board_of(solid);
    if (board != nullptr && normal.dot(board->normal) > 0.999) return look_at_board(*board, x, y);
    const Vector3d point =
        base_T_camera_.translation() + static_cast<double>(row.t[i]) * Vector3d(row.x[i], row.y[i], row.z[i]);
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    return {brightness(reflectance(scene_.solids[solid].surface), point, normal),
            row.solid[i] * kFaces + 2 * axis + (normal[axis] > 0 ? 1 : 0)};
  }

  /// Only a board's front has light and dark.
  static bool is_board(std::int32_t seen) { return seen >= 0 && seen % kFaces >= kLight; }

  enum class Around { kUniform, kBoard, kEdge };

  [[nodiscard]] Around around(int c, int r) const {
    const std::int32_t own = seen_[rays_.index(c, r)];
    bool uniform = true, board = is_board(own);
    for (int dr = r > 0 ? -1 : 0; dr <= (r + 1 < rays_.camera.height ? 1 : 0); ++dr) {
      for (int dc = c > 0 ? -1 : 0; dc <= (c + 1 < rays_.camera.width ? 1 : 0); ++dc) {
        const std::int32_t other = seen_[rays_.index(c + dc, r + dr)];
        uniform = uniform && other == own;
        board = board && is_board(other) && other / kFaces == own / kFaces;
      }
    }
    return uniform ? Around::kUniform : board ? Around::kBoard : Around::kEdge;
  }

  void resample_edges() {
    std::vector<float> resampled = gray_;
    for_row_bands(workers_, rays_.camera.height, [&](int first, int last) {
      RayRow row(kTracedSamples * kTracedSamples);
      for (int r = first; r < last; ++r) {
        for (int c = 0; c < rays_.camera.width; ++c) {
          const Around what = around(c, r);
          if (what == Around::kBoard) resampled[rays_.index(c, r)] = integrate_board(c, r);
          if (what == Around::kEdge) resampled[rays_.index(c, r)] = integrate_traced(c, r, row);
        }
      }
    });
    gray_ = std::move(resampled);
  }

  /// Normalised image points that are spread evenly over a pixel: one at random in each of n x n cells.
  template <typename Visit>
  void spread(int c, int r, int n, Visit visit) const {
    const int c0 = std::max(c - 1, 0), c1 = std::min(c + 1, rays_.camera.width - 1);
    const int r0 = std::max(r - 1, 0), r1 = std::min(r + 1, rays_.camera.height - 1);
    const std::size_t left = rays_.index(c0, r), right = rays_.index(c1, r);
    const std::size_t above = rays_.index(c, r0), below = rays_.index(c, r1);
    const float columns = static_cast<float>(c1 - c0), rows = static_cast<float>(r1 - r0);
    const float dxc = (rays_.x[right] - rays_.x[left]) / columns, dyc = (rays_.y[right] - rays_.y[left]) / columns;
    const float dxr = (rays_.x[below] - rays_.x[above]) / rows, dyr = (rays_.y[below] - rays_.y[above]) / rows;
    const std::size_t pixel = rays_.index(c, r);
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const std::uint64_t bits = jitter_.bits(pixel * 64 + static_cast<std::size_t>(j * n + i));
        const float dc = (static_cast<float>(i) + uniform_of(bits, 0)) / static_cast<float>(n) - 0.5F;
        const float dr = (static_cast<float>(j) + uniform_of(bits, 1)) / static_cast<float>(n) - 0.5F;
        visit(rays_.x[pixel] + dc * dxc + dr * dxr, rays_.y[pixel] + dc * dyc + dr * dyr);
      }
    }
  }

  [[nodiscard]] float integrate_board(int c, int r) const {
    const std::size_t pixel = rays_.index(c, r);
    const SeenBoard& board = *board_of(static_cast<std::size_t>(seen_[pixel] / kFaces));
    float sum = 0;
    spread(c, r, kBoardSamples, [&](double x, double y) {
      const Vector3d at = board.meet(x, y);
      sum += board_reflectance(board.placed, at.x(), at.y());
    });
    const Vector3d point = board.placed.base_T_board * board.meet(rays_.x[pixel], rays_.y[pixel]);
    return brightness(sum / (kBoardSamples * kBoardSamples), point, board.normal);
  }

  [[nodiscard]] float integrate_traced(int c, int r, RayRow& row) const {
    std::array<std::array<double, 2>, kTracedSamples * kTracedSamples> at;
    std::size_t count = 0;
    spread(c, r, kTracedSamples, [&](double x, double y) {
      at[count] = {x, y};
      aim(row, count++, x, y);
    });
    tracer_.trace(base_T_camera_.translation(), row, count);
    float sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += look(body_, row, i, at[i][0], at[i][1]).gray;
    return sum / static_cast<float>(count);
  }

  /// A Gaussian of five taps, first along rows, then along columns.
  void blur() {
    std::array<float, 5> taps{};
    float total = 0;
    for (int k = -2; k <= 2; ++k) {
      const auto d = static_cast<float>(k);
      total += taps[static_cast<std::size_t>(k + 2)] = std::exp(-0.5F * d * d / (kBlurSigma_px * kBlurSigma_px));
    }
    for (float& tap : taps) tap /= total;
    std::vector<float> across(gray_.size());
    pass(taps, 1, 0, gray_, across);
    pass(taps, 0, 1, across, gray_);
  }

  void pass(const std::array<float, 5>& taps, int dc, int dr, const std::vector<float>& from,
            std::vector<float>& to) const {
    const int width = rays_.camera.width, height = rays_.camera.height;
    for_rows([&](int r) {
      for (int c = 0; c < width; ++c) {
        float sum = 0;
        for (int k = -2; k <= 2; ++k) {
          const int cc = std::clamp(c + k * dc, 0, width - 1), rr = std::clamp(r + k * dr, 0, height - 1);
          sum += taps[static_cast<std::size_t>(k + 2)] * from[rays_.index(cc, rr)];
        }
        to[rays_.index(c, r)] = sum;
      }
    });
  }

  const Channel channel_;
  const Scene& scene_;
  const RayTracer& tracer_;
  const PixelRays& rays_;
  WorkerPool* const workers_;
  const Pose base_T_camera_;
  std::vector<SeenBoard> boards_;
  const BodyImage body_;
  const PixelNoise noise_, jitter_;
  std::vector<float> gray_;
  std::vector<std::int32_t> seen_;
};

}  // namespace

float board_reflectance(const BoardPlacement& board, double x_m, double y_m) {
  return is_dark(board.spec, x_m, y_m) ? kBlack : kWhite;
}

double shade(const Light& light, double reflectance, const Vector3d& point_m, const Vector3d& normal) {
  const double falling = light.ambient + light.directed * std::max(0.0, normal.dot(light.toward));
  return reflectance * falling * std::max(0.0, 1 + light.gradient_per_m.dot(point_m));
}

void render_color_image(const Scene& scene, const RayTracer& tracer, const PixelRays& rays,
                        const Transform<Base, Camera>& base_T_camera, const Exposure& exposure, Channel channel,
                        MutableGrayImage out, WorkerPool* workers) {
  ColorFrame(scene, tracer, rays, base_T_camera, exposure, channel, workers).render(out);
}

}  // namespace firstlook::sim
