/// One depth sensor or recording of OpenNI 2, from opening to its frames. The adapter to the library: its types end in
/// sensor.cpp.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "platform/core/fixed_text.hpp"

namespace firstlook::openni {

struct SensorOptions {
  std::string uri;  ///< empty: the first one that is found; a file's path: a recording
  int width = 640, height = 480;
  int rate_hz = 30;
};

enum class SensorTrouble : std::uint8_t {
  kNone,
  kLibrary,   ///< OpenNI does not start
  kNoDevice,  ///< none is connected that its drivers know; also when no driver is there, which the library does not
              ///< tell
  kNotOpen,   ///< this one cannot be opened
  kNoDepth,   ///< it has no depth stream
  kNoMode,    ///< none of its modes has the size that is asked for
  kNotStarted,
};

/// What was opened.
struct SensorInfo {
  FixedText<64> name;
  FixedText<96> uri;
  double units_per_m = 1000;
  double horizontal_fov_rad = 0, vertical_fov_rad = 0;  ///< 0: it does not say
  double rate_hz = 0;
  bool is_file = false;
  bool mirrored = false;    ///< its pictures are mirrored and it does not let us change that: columns run backwards
  bool registered = false;  ///< its depth is warped to the colour camera and cannot be had otherwise
};

/// A frame in the library's memory, valid until the next wait() or close().
struct SensorFrame {
  const std::uint8_t* rows = nullptr;  ///< 16 bits a pixel
  int stride = 0;                      ///< bytes
  int width = 0, height = 0;
  std::uint32_t index = 0;
  std::int64_t device_us = 0;  ///< the device's own clock, or since the begin of a recording
};

/// For one thread. The library is started once for the process and stays: its drivers keep threads of their own.
class Sensor {
 public:
  Sensor();
  ~Sensor();
  Sensor(const Sensor&) = delete;
  Sensor& operator=(const Sensor&) = delete;

  /// May take seconds.
  [[nodiscard]] SensorTrouble open(const SensorOptions& options);
  void close();
  [[nodiscard]] const SensorInfo& info() const { return info_; }
  /// What the library said of the last failure.
  [[nodiscard]] const FixedText<160>& words() const { return words_; }

  enum class Waited : std::uint8_t { kFrame, kNothing, kFailed };
  /// The next frame, at most `timeout_ms` from now. kNothing says no more than that none came: the library tells
  /// neither the end of a recording nor a stalled device. kFailed: it was disconnected, or cannot be read.
  [[nodiscard]] Waited wait(int timeout_ms, SensorFrame& frame);

 private:
  struct Library;
  SensorTrouble fail(SensorTrouble trouble);
  [[nodiscard]] bool choose_mode(const SensorOptions& options);
  void hold_still();
  void keep_open();

  std::unique_ptr<Library> library_;
  SensorInfo info_;
  FixedText<160> words_;
};

}  // namespace firstlook::openni
