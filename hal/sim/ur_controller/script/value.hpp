/// Values of URScript: copied when they are assigned, bounded in size.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "hal/sim/ur_controller/rotation_vector.hpp"

namespace firstlook::sim::ur::script {

struct Value;
using List = std::vector<Value>;
struct PoseValue {
  Vector6 pose{};
};
struct ThreadHandle {
  std::int64_t number = 0;
};
/// A server whose functions can be called.
struct RpcHandle {
  std::string url;
};
/// What `struct` makes: as many names as values, in the order in which they were given.
struct StructValue {
  std::vector<std::string> names;
  List values;
};

inline constexpr std::uint32_t kWeightMax = 20'000;  // elements of a list with all its lists
inline constexpr std::uint16_t kDepthMax = 100;
inline constexpr std::size_t kTextBytesMax = 64 * 1024;

struct Value {
  std::variant<std::monostate, bool, std::int64_t, double, std::string, List, PoseValue, ThreadHandle, RpcHandle,
               StructValue>
      content;
  std::uint32_t weight = 1;    ///< of a list: 1 and what its elements weigh
  std::uint16_t capacity = 0;  ///< of a list: how many elements it may have
  std::uint16_t depth = 0;     ///< of lists within each other, at least

  Value() = default;
  Value(bool value) : content(value) {}                             // NOLINT(google-explicit-constructor)
  Value(std::int64_t value) : content(value) {}                     // NOLINT(google-explicit-constructor)
  Value(double value) : content(value) {}                           // NOLINT(google-explicit-constructor)
  Value(std::string value);                                         // NOLINT(google-explicit-constructor)
  Value(const char*) = delete;                                      // would become a bool
  Value(const PoseValue& value) : content(value), weight(6) {}      // NOLINT(google-explicit-constructor)
  Value(ThreadHandle value) : content(value) {}                     // NOLINT(google-explicit-constructor)
  Value(List value);                                                // NOLINT(google-explicit-constructor)
  Value(StructValue value);                                         // NOLINT(google-explicit-constructor)
  Value(RpcHandle value) : content(std::move(value)), weight(8) {}  // NOLINT(google-explicit-constructor)

  template <typename T>
  [[nodiscard]] const T* as() const {
    return std::get_if<T>(&content);
  }
  template <typename T>
  [[nodiscard]] T* as() {
    return std::get_if<T>(&content);
  }
  /// Why no program may have such a value; empty where it may.
  [[nodiscard]] std::string_view excess();
  [[nodiscard]] bool empty() const { return std::holds_alternative<std::monostate>(content); }
  /// An integer or a float.
  [[nodiscard]] bool is_number() const { return as<std::int64_t>() != nullptr || as<double>() != nullptr; }
  [[nodiscard]] double number() const;  ///< 0 for what is none
};

[[nodiscard]] List list_of(const Vector6& values);
/// As textmsg and to_str print it: 1, 2.5, True, [1, 2], p[...].
[[nodiscard]] std::string text_of(const Value& value);
/// "bool", "int", ... for errors.
[[nodiscard]] std::string_view type_name(const Value& value);
/// With room for more elements, where there are less than that.
[[nodiscard]] Value with_capacity(List list, std::size_t capacity);
/// Of one type, or both numbers; of structs the same members. An int may stand for a thread that is none.
[[nodiscard]] bool alike(const Value& a, const Value& b);
/// Equal in URScript: numbers by value, lists and poses element by element, other types never with each other.
[[nodiscard]] bool equal(const Value& a, const Value& b);

}  // namespace firstlook::sim::ur::script
