/// A libfreenect with a Kinect that a test moves; its functions stand in the library's place in the test program.
#pragma once

#include <atomic>
#include <set>
#include <string>

namespace firstlook::test {

struct FakeKinect {
  std::atomic<bool> usb{true}, present{true}, openable{true}, stalled{false}, color_stalled{false};
  std::atomic<int> skip_depth{0};  ///< so many depth frames do not come
  std::atomic<unsigned> first_ticks{0};
  // What was done to it.
  std::atomic<int> opens{0}, led{-1}, tilts{0};
  std::atomic<bool> mirrored{true}, automatic{true}, depth_in_mm{false}, is_open{false};
};
FakeKinect& fake_kinect();

}  // namespace firstlook::test
