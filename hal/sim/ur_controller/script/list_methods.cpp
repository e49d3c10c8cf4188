#include "hal/sim/ur_controller/script/list_methods.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "hal/sim/ur_controller/script/places.hpp"

namespace firstlook::sim::ur::script {
namespace {

/// The list while a method works on it.
struct Target {
  Value& value;
  List& list;

  [[nodiscard]] std::size_t room() const { return value.capacity - std::min<std::size_t>(value.capacity, list.size()); }
};

using Arguments = std::span<const Value>;

/// Where something can be put, or a slice may end: behind the last element, too.
std::expected<std::size_t, std::string> index_up_to_end(const Value& index, const List& list) {
  const auto at = index_within(index, list.size() + 1);
  return at ? at : index_within(index, list.size());  // whose error tells the list's size
}

Computed insert_at(Target& target, std::size_t at, Arguments values) {
  List& list = target.list;
  if (values.size() > target.room()) {
    return std::unexpected(fmt::format("The list has a capacity of {} elements", target.value.capacity));
  }
  for (const Value& value : values) {
    if (value.empty()) return std::unexpected("Type error: something without a value is put into a list");
    const Value& kind = list.empty() ? values.front() : list.front();
    if (!alike(value, kind)) {
      return std::unexpected(fmt::format("Type error: a list of {} is given {}", type_name(kind), type_name(value)));
    }
  }
  list.insert(list.begin() + static_cast<std::ptrdiff_t>(at), values.begin(), values.end());
  for (const Value& value : values) {
    target.value.weight += value.weight;
    target.value.depth = std::max<std::uint16_t>(target.value.depth, static_cast<std::uint16_t>(value.depth + 1));
  }
  return Value();
}

Computed append(Target& target, Arguments arguments) { return insert_at(target, target.list.size(), arguments); }

Computed extend(Target& target, Arguments arguments) {
  const List* more = arguments[0].as<List>();
  if (more == nullptr) return std::unexpected(fmt::format("Type error: extend by {}", type_name(arguments[0])));
  return insert_at(target, target.list.size(), *more);
}

Computed insert(Target& target, Arguments arguments) {
  const auto at = index_up_to_end(arguments[0], target.list);
  return at ? insert_at(target, *at, arguments.subspan(1)) : std::unexpected(at.error());
}

Computed take(Target& target, std::size_t at) {
  Value value = std::move(target.list[at]);
  target.value.weight -= value.weight;
  target.list.erase(target.list.begin() + static_cast<std::ptrdiff_t>(at));
  if (target.list.capacity() > 4 * target.list.size() + 16)
    target.list.shrink_to_fit();  // what it weighs is what it takes
  return value;
}
Computed pop(Target& target, Arguments) {
  if (target.list.empty()) return std::unexpected("The list is empty");
  return take(target, target.list.size() - 1);
}
Computed remove(Target& target, Arguments arguments) {
  const auto at = index_within(arguments[0], target.list.size());
  return at ? take(target, *at) : std::unexpected(at.error());
}

Computed clear(Target& target, Arguments) {
  target.list = List();
  target.value.weight = 1;
  return Value();
}

/// From an index to before another.
Computed slice(Target& target, Arguments arguments) {
  const auto begin = index_up_to_end(arguments[0], target.list), end = index_up_to_end(arguments[1], target.list);
  if (!begin || !end) return std::unexpected(begin ? end.error() : begin.error());
  if (*begin > *end) return std::unexpected("A slice that ends before it begins");
  return Value(List(target.list.begin() + static_cast<std::ptrdiff_t>(*begin),
                    target.list.begin() + static_cast<std::ptrdiff_t>(*end)));
}

Value count(std::size_t number) { return static_cast<std::int64_t>(number); }

struct Method {
  std::string_view name;
  std::size_t arguments;
  bool changes;
  Computed (*run)(Target& target, Arguments arguments);
};

constexpr std::array<Method, 11> kMethods = {{
    {"append", 1, true, append},
    {"capacity", 0, false, [](Target& t, Arguments) { return Computed(count(t.value.capacity)); }},
    {"clear", 0, true, clear},
    {"excess_capacity", 0, false, [](Target& t, Arguments) { return Computed(count(t.room())); }},
    {"extend", 1, true, extend},
    {"insert", 2, true, insert},
    {"length", 0, false, [](Target& t, Arguments) { return Computed(count(t.list.size())); }},
    {"pop", 0, true, pop},
    {"remove", 1, true, remove},
    {"slice", 2, false, slice},
    {"to_string", 0, false, [](Target& t, Arguments) { return Computed(text_of(Value(t.list))); }},
}};

}  // namespace

bool is_changing_method(std::string_view method) {
  const auto found = std::ranges::find(kMethods, method, &Method::name);
  return found != kMethods.end() && found->changes;
}

Computed call_list_method(Value& list, std::string_view method, std::span<const Value> arguments) {
  if (list.as<List>() == nullptr) return std::unexpected(fmt::format("Type error: a method of {}", type_name(list)));
  const auto found = std::ranges::find(kMethods, method, &Method::name);
  if (found == kMethods.end()) return std::unexpected(fmt::format("A list has no method {}", method));
  if (arguments.size() != found->arguments) {
    return std::unexpected(fmt::format("{} takes {} arguments, not {}", method, found->arguments, arguments.size()));
  }
  Target target{list, *list.as<List>()};
  return found->run(target, arguments);
}

}  // namespace firstlook::sim::ur::script
