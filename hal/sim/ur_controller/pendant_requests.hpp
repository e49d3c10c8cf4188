/// Values that programs ask an operator for, in dialogs on the pendant.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace firstlook::sim::ur {

/// As the primary interface numbers them; kNone: a popup, which asks for nothing.
enum class RequestedType : std::uint32_t { kBoolean = 0, kInteger = 1, kFloat = 2, kString = 3, kNone = 8 };

class PendantRequests {
 public:
  using Id = std::uint32_t;
  using Entry = std::variant<bool, std::int64_t, double, std::string>;

  /// Opens a dialog.
  [[nodiscard]] Id ask(RequestedType type);
  /// Somebody fills in the oldest one: "True", "5", "2.5", a text. False where there is none, or this is not of its
  /// type.
  bool enter(std::string_view text);
  /// What was entered, once it was.
  [[nodiscard]] std::optional<Entry> take(Id id);
  void close_all() { dialogs_.clear(); }

 private:
  struct Dialog {
    Id id = 0;
    RequestedType type = RequestedType::kNone;
    std::optional<Entry> entry{};
  };
  static constexpr std::size_t kDialogsMax = 64;  // as many as a program has threads

  std::vector<Dialog> dialogs_;
  Id last_ = 0;
};

}  // namespace firstlook::sim::ur
