/// The adapter to OpenCV's filters and polygons: its types and exceptions end here.
#include "algorithms/vision/marker_quads.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <span>

#include "algorithms/vision/dark_outlines.hpp"
#include "algorithms/vision/gray_sampling.hpp"
#include "algorithms/vision/point_buckets.hpp"
#include "platform/core/fixed_vector.hpp"

namespace firstlook {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double shortest_side(const Quad& quad) {
  double shortest = (quad[0] - quad[3]).norm();
  for (std::size_t i = 0; i < 3; ++i) shortest = std::min(shortest, (quad[i + 1] - quad[i]).norm());
  return shortest;
}

bool is_same(const Quad& a, const Quad& b, double near_px) {
  // Most are far apart: the middles of the diagonals tell without the turns.
  if ((a[0] + a[2] - b[0] - b[2]).cwiseAbs().maxCoeff() > 8 * near_px) return false;
  for (std::size_t turn = 0; turn < 4; ++turn) {
    bool same = true;
    for (std::size_t i = 0; i < 4 && same; ++i) same = (a[i] - b[(i + turn) % 4]).norm() < near_px;
    if (same) return true;
  }
  return false;
}

/// The outline as OpenCV reads one, without a copy.
cv::Mat as_points(Outline outline) {
  static_assert(sizeof(Pixel) == sizeof(cv::Point));
  return {static_cast<int>(outline.size()), 1, CV_32SC2, const_cast<Pixel*>(outline.data())};
}

/// The outline as a convex quadrangle, clockwise; empty when it is none.
std::optional<Quad> quad_of(Outline outline, double side_min_px) {
  if (static_cast<double>(outline.size()) < 4 * side_min_px) return std::nullopt;
  const cv::Mat contour = as_points(outline);
  // A tenth of a side: bent or frayed sides stay one side.
  constexpr double kTolerance = 0.025;
  std::vector<cv::Point> polygon;
  cv::approxPolyDP(contour, polygon, kTolerance * cv::arcLength(contour, true), true);
  if (polygon.size() != 4 || !cv::isContourConvex(polygon)) return std::nullopt;
  Quad quad;
  for (std::size_t i = 0; i < 4; ++i) quad[i] = {polygon[i].x, polygon[i].y};
  if (cross(quad[1] - quad[0], quad[2] - quad[0]) < 0) std::swap(quad[1], quad[3]);
  if (shortest_side(quad) < side_min_px) return std::nullopt;
  return quad;
}

/// Quadrangles, none twice.
class QuadSet {
 public:
  QuadSet(int width, int height) : middles_(width, height, kBucket_px) {}
  [[nodiscard]] std::vector<Quad>& quads() { return quads_; }
  void add(const Quad& quad) {
    const double near_px = std::max(2.0, 0.1 * shortest_side(quad));
    const Eigen::Vector2d middle = (quad[0] + quad[2]) / 2;
    const auto same = [&](std::size_t q) { return is_same(quad, quads_[q], near_px); };
    if (middles_.any_near(middle, 4 * near_px, same)) return;  // as far as is_same looks
    middles_.add(middle);
    quads_.push_back(quad);
  }

 private:
  static constexpr double kBucket_px = 16;
  PointBuckets middles_;
  std::vector<Quad> quads_;
};

void add_quads(DarkOutlines& outlines, int window_px, double side_min_px, QuadSet& quads) {
  // No side is longer than the diagonal of the box.
  const auto may_be = [&](int width, int height) {
    return (width - 1) * (width - 1) + (height - 1) * (height - 1) >= side_min_px * side_min_px;
  };
  outlines.for_each(window_px, may_be, [&](Outline outline) {
    if (const auto quad = quad_of(outline, side_min_px)) quads.add(*quad);
  });
}

std::vector<Quad> search(const cv::Mat& image, double side_min_px) {
  constexpr int kWidthMax_px = 1300;
  constexpr std::array<int, 3> kWindows_px = {11, 25, 61};
  const bool half = image.cols > kWidthMax_px;
  cv::Mat searched = image;
  if (half) cv::resize(image, searched, cv::Size(), 0.5, 0.5, cv::INTER_AREA);
  // Noise that is as deep as the threshold would tie dark specks to the outlines.
  cv::Mat smooth;
  cv::GaussianBlur(searched, smooth, cv::Size(3, 3), 0);
  searched = smooth;
  DarkOutlines outlines({searched.data, searched.cols, searched.rows});
  QuadSet found(searched.cols, searched.rows);
  for (const int window : kWindows_px) {
    add_quads(outlines, window, half ? side_min_px / 2 : side_min_px, found);
  }
  std::vector<Quad> quads = std::move(found.quads());
  if (!half) return quads;
  for (Quad& quad : quads) {
    for (Eigen::Vector2d& p : quad) p = (p.array() + 0.5) * 2 - 0.5;
  }
  return quads;
}

/// A side as a parabola over the line from one rough corner to the other: point(t) = start + t along + f(t) outward.
struct Side {
  Eigen::Vector2d start, along, outward;
  Eigen::Vector3d f = Eigen::Vector3d::Zero();  ///< f(t) = f0 + f1 t + f2 t^2, t and f in pixels

  [[nodiscard]] Eigen::Vector2d point(double t) const {
    return start + t * along + (f[0] + t * (f[1] + t * f[2])) * outward;
  }
  [[nodiscard]] Eigen::Vector2d tangent(double t) const { return along + (f[1] + 2 * t * f[2]) * outward; }
};

/// Left out at both ends of a side, where the other side's edge is near.
double skipped_px(double length_px) { return std::max(1.5, 0.08 * length_px); }

struct EdgePoint {
  double t = 0, offset = 0;
  double rise = 0;  ///< grey levels from dark to white
};

constexpr std::size_t kSidePointsMax = 60;
using EdgePoints = FixedVector<EdgePoint, kSidePointsMax>;
using Lanes = std::array<double, kSidePointsMax>;  ///< a number for each point of a side

/// Where the grey values rise across the side, within `reach_px` of its present curve, at `count` places: the centres
/// of the rises. (The centre of their squares would bear more noise, but is drawn to the pixels' grid by up to a tenth
/// of a pixel.)
EdgePoints edge_points(GrayImage image, const Side& side, double length_px, double reach_px, int count) {
  constexpr double kStep_px = 0.5;
  constexpr double kRiseMin = 8;  // grey levels, all rises together
  const double skipped = skipped_px(length_px);
  const auto n = static_cast<std::size_t>(count);
  Lanes ts, from_px, first_u, first_v;  // along the side; of the first sample, from the straight line and in pixels
  for (std::size_t k = 0; k < n; ++k) {
    const double t = skipped + (length_px - 2 * skipped) * (static_cast<double>(k) + 0.5) / count;
    ts[k] = t;
    from_px[k] = side.f[0] + t * (side.f[1] + t * side.f[2]) - reach_px;
    const Eigen::Vector2d first = side.start + t * side.along + from_px[k] * side.outward;
    first_u[k] = first.x(), first_v[k] = first.y();
  }
  // Sums over the rises from sample to sample, and of each times the steps to its middle; all places side by side.
  Lanes rises{}, moments{}, u, v;
  std::array<Lanes, 2> grays;
  const int steps = static_cast<int>(std::lround(2 * reach_px / kStep_px));
  for (int i = 0; i <= steps; ++i) {
    const Eigen::Vector2d step = i * (kStep_px * side.outward);
    for (std::size_t k = 0; k < n; ++k) u[k] = first_u[k] + step.x(), v[k] = first_v[k] + step.y();
    const Lanes& before = grays[static_cast<std::size_t>(i + 1) % 2];
    Lanes& here = grays[static_cast<std::size_t>(i) % 2];
    grays_between(image, std::span(u).first(n), std::span(v).first(n), std::span(here).first(n));
    for (std::size_t k = 0; k < n && i > 0; ++k) {
      const double rise = std::max(0.0, here[k] - before[k]);
      rises[k] += rise;
      moments[k] += rise * (i - 0.5);
    }
  }
  EdgePoints points;
  for (std::size_t k = 0; k < n; ++k) {
    if (rises[k] >= kRiseMin) points.push_back({ts[k], from_px[k] + kStep_px * moments[k] / rises[k], rises[k]});
  }
  return points;
}

/// Least squares of degree 1 or 2, with the sum of squared residuals.
struct CurveFit {
  Eigen::Vector3d f = Eigen::Vector3d::Zero();
  double squared = 0;
  double bend_sigma = 0;  ///< of f2 for an offset sigma of 1
};

CurveFit fit_curve(const EdgePoints& points, bool bent) {
  std::array<double, 5> powers{};  // sums of t^k
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const EdgePoint& p : points) {
    const double t2 = p.t * p.t;
    powers[0] += 1, powers[1] += p.t, powers[2] += t2, powers[3] += t2 * p.t, powers[4] += t2 * t2;
    right += p.offset * Eigen::Vector3d(1, p.t, t2);
  }
  Eigen::Matrix3d normal;
  normal << powers[0], powers[1], powers[2], powers[1], powers[2], powers[3], powers[2], powers[3], powers[4];
  CurveFit fit;
  if (bent) {
    const Eigen::Matrix3d inverse = normal.inverse();
    fit.f = inverse * right;
    fit.bend_sigma = std::sqrt(inverse(2, 2));
  } else {
    fit.f.head<2>() = normal.topLeftCorner<2, 2>().inverse() * right.head<2>();
  }
  for (const EdgePoint& p : points) {
    const double r = p.offset - (fit.f[0] + p.t * (fit.f[1] + p.t * fit.f[2]));
    fit.squared += r * r;
  }
  return fit;
}

/// Leaves out the points that lie farther than three sigmas off the curve.
EdgePoints without_outliers(const EdgePoints& points, const CurveFit& fit) {
  const double sigma = std::max(0.05, std::sqrt(fit.squared / static_cast<double>(points.size())));
  EdgePoints kept;
  for (const EdgePoint& p : points) {
    if (std::abs(p.offset - (fit.f[0] + p.t * (fit.f[1] + p.t * fit.f[2]))) <= 3 * sigma) kept.push_back(p);
  }
  return kept;
}

/// The mean rise of the side's edge, grey levels; empty when there is none.
std::optional<double> refine_side(GrayImage image, double length_px, double reach_px, int points_max, Side& side) {
  constexpr int kPointsMin = 6, kPointsForBend = 16;
  const int count = std::clamp(static_cast<int>(length_px - 2 * skipped_px(length_px)), kPointsMin, points_max);
  EdgePoints points = edge_points(image, side, length_px, reach_px, count);
  if (static_cast<int>(points.size()) * 2 < std::max(count, 2 * kPointsMin - 2)) return std::nullopt;
  double rise = 0;
  for (const EdgePoint& p : points) rise += p.rise / static_cast<double>(points.size());
  CurveFit straight = fit_curve(points, false);
  points = without_outliers(points, straight);
  if (points.size() < 4) return std::nullopt;
  straight = fit_curve(points, false);
  side.f = straight.f;
  if (static_cast<int>(points.size()) < kPointsForBend) return rise;
  // Bent only where the bend is likely: a parabola's ends are half as sure as a line's, and a bend of 1.5 sigmas costs
  // a line as much as that.
  constexpr double kBendSigmas = 1.5;
  const CurveFit bent = fit_curve(points, true);
  const double sigma = std::sqrt(bent.squared / (static_cast<double>(points.size()) - 3));
  if (std::abs(bent.f[2]) > kBendSigmas * sigma * bent.bend_sigma) side.f = bent.f;
  return rise;
}

/// Where two sides meet near `start`: tangents crossed a few times.
std::optional<Eigen::Vector2d> meeting(const Side& a, const Side& b, const Eigen::Vector2d& start) {
  Eigen::Vector2d at = start;
  for (int i = 0; i < 4; ++i) {
    const double ta = (at - a.start).dot(a.along), tb = (at - b.start).dot(b.along);
    const Eigen::Vector2d pa = a.point(ta), da = a.tangent(ta), pb = b.point(tb), db = b.tangent(tb);
    const double parallel = cross(da, db);
    if (std::abs(parallel) < 0.05) return std::nullopt;
    at = pa + cross(pb - pa, db) / parallel * da;
  }
  return at;
}

}  // namespace

Result<std::vector<Quad>> find_dark_quads(GrayImage image, double side_min_px) {
  try {
    cv::setNumThreads(1);  // results and memory must not depend on the number of cores
    // OpenCV has no read-only header for foreign pixels; nothing writes to it.
    return search(cv::Mat(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data)), side_min_px);
  } catch (const cv::Exception& e) {
    return failure(Fault::kBoardNotFound, "OpenCV: {}", e.err);
  } catch (const std::bad_alloc&) {
    return failure(Fault::kOutOfMemory, "searching markers in {}x{} pixels", image.width, image.height);
  }
}

bool refine_quad(GrayImage image, double cell_px, QuadFit fit, Quad& quad) {
  struct Round {
    double widest_px;
    int points_max;  ///< on a side
  };
  // Wide first, since contours are a pixel off; then narrow around what was found, the last time with all points. Only
  // rises from dark to white count, so the border's inner edge does no harm.
  constexpr std::array<Round, 3> kRounds = {{{3.0, 16}, {2.0, 16}, {1.5, kSidePointsMax}}};
  std::array<Side, 4> sides;
  for (const Round& round : std::span(kRounds).first(fit == QuadFit::kToRead ? 1 : kRounds.size())) {
    const double reach_px = std::clamp(0.9 * cell_px, 1.5, round.widest_px);
    double lowest = std::numeric_limits<double>::infinity(), highest = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d &a = quad[i], &b = quad[(i + 1) % 4];
      const double length = (b - a).norm();
      if (length < 4) return false;
      const Eigen::Vector2d along = (b - a) / length;
      // Clockwise with y down: outside is on the left of the way.
      sides[i] = {a, along, {along.y(), -along.x()}};
      const auto rise = refine_side(image, length, reach_px, round.points_max, sides[i]);
      if (!rise) return false;
      lowest = std::min(lowest, *rise), highest = std::max(highest, *rise);
    }
    // A weak side is the edge of something else that hides a part.
    constexpr double kRiseShareMin = 0.65;
    if (lowest < kRiseShareMin * highest) return false;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto corner = meeting(sides[(i + 3) % 4], sides[i], quad[i]);
      if (!corner || (*corner - quad[i]).norm() > std::max(3.0, cell_px)) return false;
      quad[i] = *corner;
    }
  }
  return true;
}

}  // namespace firstlook
