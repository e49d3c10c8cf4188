#include "hal/sim/ur_controller/script/names.hpp"

#include "hal/sim/ur_controller/script/list_methods.hpp"

namespace firstlook::sim::ur::script {
namespace {

using Kind = Token::Kind;

bool opens_function(const std::vector<Token>& tokens, std::size_t i) {
  const bool word = tokens[i].is("def") || tokens[i].is("sec") || tokens[i].is("thread");
  return word && tokens[i + 1].kind == Kind::kName;
}

int bracket(const Token& token) { return token.is("(") || token.is("[") ? 1 : token.is(")") || token.is("]") ? -1 : 0; }

/// The names between the brackets of a function's head.
std::vector<std::string> parameters_at(const std::vector<Token>& tokens, std::size_t i) {
  std::vector<std::string> names;
  int depth = 0;
  for (; i < tokens.size() && tokens[i].kind != Kind::kLineEnd; ++i) {
    depth += bracket(tokens[i]);
    const bool begins = depth == 1 && (tokens[i - 1].is("(") || tokens[i - 1].is(","));
    if (begins && tokens[i].kind == Kind::kName) names.push_back(tokens[i].text);
    if (depth == 0) break;
  }
  return names;
}

}  // namespace

std::size_t end_of_place(const std::vector<Token>& tokens, std::size_t i) {
  const auto is = [&](std::size_t at, std::string_view symbol) { return at < tokens.size() && tokens[at].is(symbol); };
  std::size_t j = i + 1;
  while (is(j, "[") || (is(j, ".") && tokens[j + 1].kind == Kind::kName && !is(j + 2, "("))) {
    if (is(j, ".")) {
      j += 2;
      continue;
    }
    int open = 0;
    do {
      open += is(j, "[") ? 1 : is(j, "]") ? -1 : 0;
      ++j;
    } while (j < tokens.size() && open > 0);
  }
  return j;
}

bool assigns(const std::vector<Token>& tokens, std::size_t i) {
  const std::size_t j = end_of_place(tokens, i);
  return j < tokens.size() && tokens[j].is("=") && !(i > 0 && tokens[i - 1].is("."));
}

bool changes_list(const std::vector<Token>& tokens, std::size_t i) {
  const std::size_t j = end_of_place(tokens, i);
  return j + 2 < tokens.size() && tokens[j].is(".") && is_changing_method(tokens[j + 1].text) && tokens[j + 2].is("(");
}

bool sets_signal(const std::vector<Token>& tokens, std::size_t i) {
  return tokens[i].is("digital_out") && i + 1 < tokens.size() && tokens[i + 1].is("[");
}

namespace {

/// @param program  where the `def` or `sec` stands that holds everything; beyond the end: nowhere
Names find_names(const std::vector<Token>& tokens, std::size_t program) {
  Names names;
  std::vector<bool> blocks;  // for each open one: is it a function?
  int functions = 0, brackets = 0;
  const int body = program < tokens.size() ? 1 : 0;
  for (std::size_t i = 0; i + 1 < tokens.size(); ++i) {
    const Token& token = tokens[i];
    brackets += bracket(token);
    const bool member = i > 0 && tokens[i - 1].is(".");
    if (token.kind != Kind::kName || brackets != 0 || member) continue;
    if (opens_function(tokens, i)) {
      if (i != program) names.functions[tokens[i + 1].text] = parameters_at(tokens, i + 2);
      blocks.push_back(true);
      ++functions;
    } else if (token.is("if") || token.is("while")) {
      blocks.push_back(false);
    } else if (token.is("end") && !blocks.empty()) {
      functions -= blocks.back() ? 1 : 0;
      blocks.pop_back();
    } else if (token.is("global")) {
      names.declared.push_back(tokens[i + 1]);
    } else if (functions == body && tokens[i + 1].is("=") && assigns(tokens, i) &&
               !(i > 0 && tokens[i - 1].is("local"))) {
      names.assigned.push_back(token.text);
    }
  }
  return names;
}

}  // namespace

Names find_program_names(const std::vector<Token>& tokens) {
  std::size_t first = 0;
  while (first + 1 < tokens.size() && tokens[first].kind == Kind::kLineEnd) ++first;
  const bool whole = tokens[first].is("def") || tokens[first].is("sec");
  return find_names(tokens, whole ? first : tokens.size());
}

Names find_statement_names(const std::vector<Token>& tokens) { return find_names(tokens, tokens.size()); }

}  // namespace firstlook::sim::ur::script
