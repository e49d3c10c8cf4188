#include "hal/sim/ur_controller/script/xml_rpc.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <type_traits>

#include "hal/sim/ur_controller/script/places.hpp"

namespace firstlook::sim::ur::script {
namespace {

constexpr int kNestingMax = 50;
constexpr std::array<std::string_view, 6> kPoseMembers = {"x", "y", "z", "rx", "ry", "rz"};
constexpr std::array<std::pair<std::string_view, char>, 5> kEntities = {
    {{"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}, {"&amp;", '&'}}};

void write_text(std::string& xml, std::string_view text) {
  for (const char c : text) {
    if (c == '<') {
      xml += "&lt;";
    } else if (c == '>') {
      xml += "&gt;";
    } else if (c == '&') {
      xml += "&amp;";
    } else {
      xml += c;
    }
  }
}

bool write_value(std::string& xml, const Value& value) {
  xml += "<value>";
  if (const bool* flag = value.as<bool>()) {
    xml += fmt::format("<boolean>{}</boolean>", *flag ? 1 : 0);
  } else if (const auto* integer = value.as<std::int64_t>()) {
    xml += fmt::format("<i4>{}</i4>", *integer);
  } else if (const auto* real = value.as<double>()) {
    xml += fmt::format("<double>{:.12f}</double>", *real);  // no exponents in XML-RPC
  } else if (const auto* text = value.as<std::string>()) {
    xml += "<string>";
    write_text(xml, *text);
    xml += "</string>";
  } else if (const auto* list = value.as<List>()) {
    xml += "<array><data>";
    for (const Value& element : *list) {
      if (!write_value(xml, element)) return false;
    }
    xml += "</data></array>";
  } else if (const auto* pose = value.as<PoseValue>()) {
    xml += "<struct>";
    for (std::size_t i = 0; i < kPoseMembers.size(); ++i) {
      xml += fmt::format("<member><name>{}</name><value><double>{:.12f}</double></value></member>", kPoseMembers[i],
                         pose->pose[i]);
    }
    xml += "</struct>";
  } else if (const auto* members = value.as<StructValue>()) {
    xml += "<struct>";
    for (std::size_t i = 0; i < members->names.size(); ++i) {
      xml += "<member><name>";
      write_text(xml, members->names[i]);
      xml += "</name>";
      if (!write_value(xml, members->values[i])) return false;
      xml += "</member>";
    }
    xml += "</struct>";
  } else {
    return false;
  }
  xml += "</value>";
  return true;
}

/// Reads elements one after the other. What does not fit ends it: `ok()` is false from then on.
class Reader {
 public:
  explicit Reader(std::string_view xml) : rest_(xml) {}

  [[nodiscard]] bool ok() const { return ok_; }

  /// "<name>", after blanks, comments and declarations.
  bool opens(std::string_view name) { return tag(fmt::format("<{}>", name)); }
  void open(std::string_view name) {
    if (!opens(name)) ok_ = false;
  }
  void close(std::string_view name) {
    if (!tag(fmt::format("</{}>", name))) ok_ = false;
  }

  Value value(int nesting = 0) {
    open("value");
    Value answer = nesting < kNestingMax && ok_ ? content(nesting) : stop();
    close("value");
    return answer;
  }

 private:
  Value stop() {
    ok_ = false;
    return {};
  }
  void skip() {
    while (!rest_.empty()) {
      const bool declaration = rest_.starts_with("<?"), comment = rest_.starts_with("<!--");
      if (declaration || comment) {
        const std::string_view end_mark = declaration ? "?>" : "-->";
        const std::size_t end = rest_.find(end_mark);
        rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + end_mark.size());
      } else if (rest_.front() == ' ' || rest_.front() == '\n' || rest_.front() == '\r' || rest_.front() == '\t') {
        rest_.remove_prefix(1);
      } else {
        return;
      }
    }
  }
  bool tag(std::string_view text) {
    const std::string_view before = rest_;
    skip();
    if (ok_ && rest_.starts_with(text)) {
      rest_.remove_prefix(text.size());
      return true;
    }
    rest_ = before;
    return false;
  }
  /// To the next element, as it stands there.
  std::string text() {
    const std::size_t end = std::min(rest_.find('<'), rest_.size());
    std::string_view raw = rest_.substr(0, end);
    rest_.remove_prefix(end);
    std::string result;
    while (!raw.empty()) {
      std::size_t taken = 1;
      char c = raw.front();
      for (const auto& [entity, character] : kEntities) {
        if (!raw.starts_with(entity)) continue;
        taken = entity.size();
        c = character;
      }
      if (c == '&' && raw.starts_with("&#")) c = numbered(raw, taken);
      result += c;
      raw.remove_prefix(taken);
    }
    return result;
  }
  /// "&#65;", of one byte.
  static char numbered(std::string_view raw, std::size_t& taken) {
    int code = '?';
    const auto [end, error] = std::from_chars(raw.data() + 2, raw.data() + raw.size(), code);
    if (error != std::errc{} || end == raw.data() + raw.size() || *end != ';') return '&';
    taken = static_cast<std::size_t>(end - raw.data()) + 1;
    return code > 0 && code < 256 ? static_cast<char>(code) : '?';
  }
  template <typename Number>
  Value number() {
    const std::string digits = text();
    const char* begin = digits.data();
    const char* const end = begin + digits.size();
    if (!digits.empty() && digits.front() == '+') ++begin;
    Number number{};
    const auto [read_to, error] = std::from_chars(begin, end, number);
    if (error != std::errc{} || read_to != end || !std::isfinite(static_cast<double>(number))) ok_ = false;
    return static_cast<std::conditional_t<std::is_integral_v<Number>, std::int64_t, double>>(number);
  }

  Value content(int nesting) {
    for (const std::string_view name : {"i4", "int"}) {
      if (opens(name)) return closed(number<std::int32_t>(), name);
    }
    if (opens("i8")) return closed(number<std::int64_t>(), "i8");
    if (opens("double")) return closed(number<double>(), "double");
    if (opens("boolean")) return closed(text() == "1", "boolean");
    if (opens("string")) return closed(text(), "string");
    if (tag("<string/>")) return std::string();
    if (opens("array")) return array(nesting);
    if (tag("<struct/>")) return StructValue();
    if (opens("struct")) return structure(nesting);
    if (tag("<nil/>")) return {};
    const std::string untyped = text();
    return rest_.starts_with("</value>") ? Value(untyped) : stop();
  }
  Value closed(Value value, std::string_view name) {
    close(name);
    return value;
  }
  Value array(int nesting) {
    List list;
    if (!tag("<data/>")) {
      open("data");
      while (ok_ && !tag("</data>")) {
        list.push_back(value(nesting + 1));
      }
    }
    close("array");
    return list;
  }
  /// A pose, where it has just the members of one.
  Value structure(int nesting) {
    StructValue read;
    while (ok_ && !tag("</struct>")) {
      open("member");
      open("name");
      read.names.push_back(text());
      close("name");
      read.values.push_back(value(nesting + 1));
      close("member");
    }
    PoseValue pose;
    for (std::size_t i = 0; i < kPoseMembers.size(); ++i) {
      const auto name = std::ranges::find(read.names, kPoseMembers[i]);
      if (name == read.names.end() || read.names.size() != kPoseMembers.size()) return read;
      const Value& member = read.values[static_cast<std::size_t>(name - read.names.begin())];
      if (!member.is_number()) return read;
      pose.pose[i] = member.number();
    }
    return pose;
  }

  std::string_view rest_;
  bool ok_ = true;
};

}  // namespace

std::expected<std::string, std::string> xml_rpc_call(std::string_view method, std::span<const Value> arguments) {
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\r\n<methodCall>\r\n<methodName>";
  write_text(xml, method);
  xml += "</methodName>\r\n<params>\r\n";
  for (const Value& argument : arguments) {
    xml += "<param>";
    if (!write_value(xml, argument)) {
      return std::unexpected(fmt::format("{} cannot be sent", type_name(argument)));
    }
    xml += "</param>\r\n";
  }
  return xml + "</params>\r\n</methodCall>\r\n";
}

std::expected<Value, std::string> read_xml_rpc_answer(std::string_view xml) {
  Reader reader(xml);
  reader.open("methodResponse");
  if (reader.opens("fault")) {
    const Computed said = element_of(reader.value(), std::vector<Value>{std::string("faultString")});
    return std::unexpected(said ? text_of(*said) : "a fault");
  }
  reader.open("params");
  if (reader.ok() && !reader.opens("param")) return Value();
  Value answer = reader.value();
  reader.close("param");
  reader.close("params");
  reader.close("methodResponse");
  if (!reader.ok()) return std::unexpected("the answer cannot be read");
  return answer;
}

}  // namespace firstlook::sim::ur::script
