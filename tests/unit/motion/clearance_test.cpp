#include "algorithms/motion/clearance.hpp"

#include <catch2/catch.hpp>

using namespace firstlook;

TEST_CASE("the clearance is the sum of its terms") {
  ClearanceInputs in;
  in.voxel_m = 0.05;
  in.range_m = 2;
  in.sigma_hand_eye_m = 0.0003;
  in.sigma_hand_eye_rad = 0.001;
  in.sigma_depth_at_1m_m = 0.001;
  in.sigma_tracking_m = 0.0005;
  in.payload_sag_m = 0.001;
  in.speed_m_s = 0.25;
  in.reaction_s = 0.016;
  in.deceleration_m_s2 = 2.5;
  const ClearanceTerms t = required_clearance(in);
  CHECK(t.half_voxel_diagonal_m == Approx(0.0433013));
  CHECK(t.sigma_hand_eye_m == Approx(std::sqrt(0.0003 * 0.0003 + 0.002 * 0.002)));
  CHECK(t.sigma_depth_m == Approx(0.004));
  CHECK(t.uncertainty_m == Approx(3 * std::sqrt(0.0003 * 0.0003 + 0.002 * 0.002 + 0.004 * 0.004 + 0.0005 * 0.0005)));
  CHECK(t.stopping_m == Approx(0.25 * 0.016 + 0.0625 / 5));
  CHECK(t.voxels_m == Approx(t.half_voxel_diagonal_m + t.uncertainty_m + 0.001 + t.stopping_m));
  CHECK(t.surface_m == Approx(3 * 0.0005 + 0.001 + t.stopping_m));
  CHECK(t.clearance().voxels_m == t.voxels_m);
  CHECK(t.clearance().surface_m == t.surface_m);
}

TEST_CASE("every worse input needs more clearance") {
  const ClearanceInputs in;
  const double base = required_clearance(in).voxels_m;
  const auto worse = [&](auto member, double factor) {
    ClearanceInputs changed = in;
    changed.*member = changed.*member * factor + (factor > 1 ? 0.001 : 0);
    return required_clearance(changed).voxels_m;
  };
  CHECK(worse(&ClearanceInputs::voxel_m, 2) > base);
  CHECK(worse(&ClearanceInputs::range_m, 2) > base);
  CHECK(worse(&ClearanceInputs::sigma_hand_eye_m, 2) > base);
  CHECK(worse(&ClearanceInputs::sigma_hand_eye_rad, 2) > base);
  CHECK(worse(&ClearanceInputs::sigma_depth_at_1m_m, 2) > base);
  CHECK(worse(&ClearanceInputs::sigma_tracking_m, 2) > base);
  CHECK(worse(&ClearanceInputs::payload_sag_m, 2) > base);
  CHECK(worse(&ClearanceInputs::speed_m_s, 2) > base);
  CHECK(worse(&ClearanceInputs::reaction_s, 2) > base);
  CHECK(worse(&ClearanceInputs::deceleration_m_s2, 0.5) > base);
}
