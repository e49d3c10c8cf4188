/// A small reader of XML for tests: elements, attributes and comments, strict about what it knows. Written apart from
/// the program's writers, so that it can contradict them.
#pragma once

#include <cctype>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace firstlook::test {

struct XmlElement {
  std::string name;
  std::map<std::string, std::string> attributes;
  std::vector<XmlElement> children;

  /// All elements of that name, at any depth, in their order.
  [[nodiscard]] std::vector<const XmlElement*> all(std::string_view wanted) const {
    std::vector<const XmlElement*> found;
    for (const XmlElement& child : children) {
      if (child.name == wanted) found.push_back(&child);
      for (const XmlElement* deeper : child.all(wanted)) found.push_back(deeper);
    }
    return found;
  }
  /// The only child of that name.
  [[nodiscard]] const XmlElement& only(std::string_view wanted) const {
    const XmlElement* found = nullptr;
    for (const XmlElement& child : children) {
      if (child.name != wanted) continue;
      if (found != nullptr) throw std::runtime_error("more than one " + std::string(wanted));
      found = &child;
    }
    if (found == nullptr) throw std::runtime_error("no " + std::string(wanted) + " in " + name);
    return *found;
  }
};

/// Reads a document. Throws std::runtime_error for what is not well-formed (and for text between elements).
class XmlReader {
 public:
  explicit XmlReader(std::string_view text) : text_(text) {}

  XmlElement document() {
    if (take("<?xml")) skip_behind("?>");
    skip_comments();
    XmlElement root = element();
    skip_comments();
    if (at_ != text_.size()) fail("something behind the root element");
    return root;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(what + " at byte " + std::to_string(at_));
  }
  [[nodiscard]] bool take(std::string_view token) {
    if (text_.substr(at_, token.size()) != token) return false;
    at_ += token.size();
    return true;
  }
  void skip_behind(std::string_view token) {
    const std::size_t end = text_.find(token, at_);
    if (end == std::string_view::npos) fail("no " + std::string(token));
    at_ = end + token.size();
  }
  void skip_space() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }
  void skip_comments() {
    for (skip_space(); take("<!--"); skip_space()) {
      skip_behind("--");
      if (!take(">")) fail("two hyphens inside a comment");
    }
  }
  std::string word() {
    const std::size_t begin = at_;
    const auto part = [](char c) {
      return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == ':' || c == '-';
    };
    while (at_ < text_.size() && part(text_[at_])) ++at_;
    if (at_ == begin) fail("no name");
    return std::string(text_.substr(begin, at_ - begin));
  }
  XmlElement element() {
    if (!take("<")) fail("no element");
    XmlElement element;
    element.name = word();
    for (skip_space(); !take("/>"); skip_space()) {
      if (take(">")) {
        content(element);
        break;
      }
      const std::string key = word();
      if (!take("=\"")) fail("no value of " + key);
      const std::size_t begin = at_;
      skip_behind("\"");
      const std::string value(text_.substr(begin, at_ - 1 - begin));
      if (value.find_first_of("<&") != std::string::npos) fail("markup in a value");
      if (!element.attributes.emplace(key, value).second) fail(key + " twice");
    }
    return element;
  }
  void content(XmlElement& element) {
    for (skip_comments(); !take("</"); skip_comments()) element.children.push_back(this->element());
    if (word() != element.name) fail("wrong end of " + element.name);
    skip_space();
    if (!take(">")) fail("no end of " + element.name);
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace firstlook::test
