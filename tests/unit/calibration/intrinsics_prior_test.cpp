#include "algorithms/calibration/intrinsics_prior.hpp"

#include <catch2/catch.hpp>

using namespace firstlook;

namespace {
const CameraIntrinsics kCamera{640, 480, 530, 531, 320, 240, .1, -.2, .001, .002, 0};
}

TEST_CASE("what is solved for, and what is believed of it", "[calibration]") {
  CHECK(belief_of(EstimatedIntrinsics::kNone, {}).count == 0);
  CHECK(belief_of(EstimatedIntrinsics::kNone, {}).weight.isZero());
  const IntrinsicsBelief lens = belief_of(EstimatedIntrinsics::kWithoutK3, {});
  CHECK(lens.count == 8);
  CHECK(lens.weight.head<4>().isZero());  // any camera
  CHECK(lens.weight[4] == 1);
  CHECK(lens.weight[8] == 0);  // not solved for
  CHECK(belief_of(EstimatedIntrinsics::kAll, {}).weight[8] > 0);

  IntrinsicsPrior prior{kCamera, IntrinsicsVector::Zero()};
  prior.sigma[0] = 2;
  prior.sigma[5] = 0.1;
  const IntrinsicsBelief stated = belief_of(EstimatedIntrinsics::kWithoutK3, prior);
  CHECK(stated.weight[0] == 0.25);
  CHECK(stated.mean[0] == 530);
  CHECK(stated.mean[5] == -.2);
  CHECK(stated.weight[1] == 0);
  CHECK(stated.weight[4] == 1);  // not stated: what lenses are like
  CameraIntrinsics off = kCamera;
  off.fx = 534;
  CHECK(stated.right(off)[0] == -1);
}

TEST_CASE("what the views do not tell is named", "[calibration]") {
  IntrinsicsVector sigma = IntrinsicsVector::Constant(1e-3);
  const IntrinsicsBelief lens = belief_of(EstimatedIntrinsics::kWithoutK3, {});
  CHECK(untold_distortion(lens, sigma).empty());
  CHECK(undetermined_intrinsics(kCamera, sigma).empty());
  sigma[5] = 1.5;
  sigma[6] = 0.04;
  sigma[8] = 100;  // not solved for
  CHECK(untold_distortion(lens, sigma) == "k2, p1");
  sigma[1] = 40;
  sigma[2] = 33;
  CHECK(undetermined_intrinsics(kCamera, sigma) == "fy (sigma 40 px), cx (sigma 33 px)");
  CHECK(undetermined_intrinsics(kCamera, sigma, 0.1).empty());
}
