#include "hal/sim/ur_controller/script/lexer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace firstlook::sim::ur::script {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

class Lexer {
 public:
  explicit Lexer(std::string_view script) : script_(script) {}

  std::expected<std::vector<Token>, ScriptError> run() {
    while (at_ < script_.size()) {
      if (!next()) return std::unexpected(syntax_error(script_, line_, column()));
    }
    end_line();
    push(Token::Kind::kEnd, "");
    return std::move(tokens_);
  }

 private:
  [[nodiscard]] char peek(std::size_t ahead = 0) const {
    return at_ + ahead < script_.size() ? script_[at_ + ahead] : '\0';
  }
  [[nodiscard]] int column() const { return static_cast<int>(at_ - line_begin_) + 1; }
  void push(Token::Kind kind, std::string_view text) { tokens_.push_back({kind, std::string(text), line_, column()}); }
  void end_line() {
    if (!tokens_.empty() && tokens_.back().kind != Token::Kind::kLineEnd && !goes_on(tokens_.back())) {
      push(Token::Kind::kLineEnd, "");
    }
  }
  /// A line that ends in an operator is continued on the next one.
  [[nodiscard]] static bool goes_on(const Token& last) {
    constexpr std::array<std::string_view, 15> kOperators = {"or", "and", "xor", "not", "+",  "-", "*", "/",
                                                             "%",  "==",  "!=",  "<=",  ">=", "<", ">"};
    return (last.kind == Token::Kind::kName || last.kind == Token::Kind::kSymbol) &&
           std::ranges::find(kOperators, last.text) != kOperators.end();
  }

  bool next() {
    const char c = peek();
    if (c == '\n') {
      if (depth_ == 0) end_line();
      ++at_;
      ++line_;
      line_begin_ = at_;
      return true;
    }
    if (c == ' ' || c == '\t' || c == '\r') return ++at_, true;
    if (c == ';') {
      end_line();
      return ++at_, true;
    }
    if (c == '#') {
      while (at_ < script_.size() && peek() != '\n') ++at_;
      return true;
    }
    if (c == '"') return text();
    if (is_letter(c)) return name();
    if (is_digit(c) || (c == '.' && is_digit(peek(1)))) return number();
    return symbol();
  }

  bool text() {
    const std::size_t end = script_.find_first_of("\"\n", at_ + 1);
    if (end == std::string_view::npos || script_[end] != '"') return false;
    push(Token::Kind::kText, script_.substr(at_ + 1, end - at_ - 1));
    at_ = end + 1;
    return true;
  }

  bool name() {
    std::size_t end = at_;
    while (end < script_.size() && (is_letter(script_[end]) || is_digit(script_[end]))) ++end;
    push(Token::Kind::kName, script_.substr(at_, end - at_));
    at_ = end;
    return true;
  }

  bool number() {
    std::size_t end = at_;
    bool real = false;
    const auto digits = [&] {
      while (end < script_.size() && is_digit(script_[end])) ++end;
    };
    digits();
    if (end < script_.size() && script_[end] == '.') {
      real = true;
      ++end;
      digits();
    }
    if (end < script_.size() && (script_[end] == 'e' || script_[end] == 'E')) {
      std::size_t exponent = end + 1;
      if (exponent < script_.size() && (script_[exponent] == '-' || script_[exponent] == '+')) ++exponent;
      if (exponent >= script_.size() || !is_digit(script_[exponent])) return false;
      real = true;
      end = exponent;
      digits();
    }
    push(real ? Token::Kind::kFloat : Token::Kind::kInteger, script_.substr(at_, end - at_));
    at_ = end;
    return end >= script_.size() || !is_letter(script_[end]);
  }

  bool symbol() {
    constexpr std::array<std::string_view, 4> kTwo = {"==", "!=", "<=", ">="};
    const std::string_view two = script_.substr(at_, 2);
    const bool pair = std::ranges::find(kTwo, two) != kTwo.end();
    const std::string_view found = pair ? two : script_.substr(at_, 1);
    if (!pair && std::string_view("+-*/%<>=()[],:.{}$").find(found[0]) == std::string_view::npos) return false;
    if (found == "(" || found == "[") ++depth_;
    if (found == ")" || found == "]") depth_ = std::max(0, depth_ - 1);
    push(Token::Kind::kSymbol, found);
    at_ += found.size();
    return true;
  }

  std::string_view script_;
  std::size_t at_ = 0, line_begin_ = 0;
  int line_ = 1;
  int depth_ = 0;  ///< of brackets
  std::vector<Token> tokens_;
};

}  // namespace

bool is_keyword(std::string_view word) {
  constexpr std::array<std::string_view, 26> kWords = {
      "and",           "break", "continue", "def",    "elif", "else", "end",    "enter_critical",
      "exit_critical", "False", "global",   "halt",   "if",   "join", "kill",   "local",
      "not",           "or",    "pass",     "return", "run",  "sec",  "thread", "True",
      "while",         "xor"};
  return std::ranges::find(kWords, word) != kWords.end();
}

std::expected<std::vector<Token>, ScriptError> tokenize(std::string_view script) { return Lexer(script).run(); }

ScriptError syntax_error(std::string_view script, int line, int column) {
  for (int i = 1; i < line; ++i) {
    const std::size_t end = script.find('\n');
    script.remove_prefix(end == std::string_view::npos ? script.size() : end + 1);
  }
  std::string_view shown = script.substr(0, script.find('\n')).substr(0, 200);
  while (!shown.empty() && shown.back() == '\r') shown.remove_suffix(1);
  return {line, column, fmt::format("syntax_error_on_line:{}:{}:", line, shown)};
}

}  // namespace firstlook::sim::ur::script
