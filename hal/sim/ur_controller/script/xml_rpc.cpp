#include "hal/sim/ur_controller/script/xml_rpc.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <type_traits>

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
  } else {
    return false;
  }
  xml += "</value>";
  return true;
}

/// What an answer holds: a URScript value, or a struct that is none.
struct Answer {
  Value value;
  std::map<std::string, Value> members{};
};

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

  Answer value(int nesting = 0) {
    open("value");
    Answer answer = nesting < kNestingMax && ok_ ? content(nesting) : stop();
    close("value");
    return answer;
  }

 private:
  Answer stop() {
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

  Answer content(int nesting) {
    for (const std::string_view name : {"i4", "int"}) {
      if (opens(name)) return closed(number<std::int32_t>(), name);
    }
    if (opens("i8")) return closed(number<std::int64_t>(), "i8");
    if (opens("double")) return closed(number<double>(), "double");
    if (opens("boolean")) return closed(text() == "1", "boolean");
    if (opens("string")) return closed(text(), "string");
    if (tag("<string/>")) return {std::string()};
    if (opens("array")) return array(nesting);
    if (opens("struct")) return structure(nesting);
    if (tag("<nil/>")) return {};
    const std::string untyped = text();
    return rest_.starts_with("</value>") ? Answer{untyped} : stop();
  }
  Answer closed(Value value, std::string_view name) {
    close(name);
    return {std::move(value)};
  }
  Answer array(int nesting) {
    List list;
    if (!tag("<data/>")) {
      open("data");
      while (ok_ && !tag("</data>")) {
        Answer element = value(nesting + 1);
        if (!element.members.empty()) return stop();
        list.push_back(std::move(element.value));
      }
    }
    close("array");
    return {Value(std::move(list))};
  }
  Answer structure(int nesting) {
    Answer answer;
    while (ok_ && !tag("</struct>")) {
      open("member");
      open("name");
      const std::string name = text();
      close("name");
      answer.members[name] = value(nesting + 1).value;
      close("member");
    }
    PoseValue pose;
    for (std::size_t i = 0; i < kPoseMembers.size(); ++i) {
      const auto member = answer.members.find(std::string(kPoseMembers[i]));
      if (member == answer.members.end() || !member->second.is_number()) return answer;
      pose.pose[i] = member->second.number();
    }
    return {Value(pose)};
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
    const Answer fault = reader.value();
    const auto said = fault.members.find("faultString");
    return std::unexpected(said == fault.members.end() ? "a fault" : text_of(said->second));
  }
  reader.open("params");
  if (reader.ok() && !reader.opens("param")) return Value();
  const Answer answer = reader.value();
  reader.close("param");
  reader.close("params");
  reader.close("methodResponse");
  if (!reader.ok()) return std::unexpected("the answer cannot be read");
  if (!answer.members.empty()) return std::unexpected("the answer is a struct that is no pose");
  return answer.value;
}

}  // namespace firstlook::sim::ur::script
