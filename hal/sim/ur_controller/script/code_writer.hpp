/// The instructions of a script as a compiler writes them: functions, the names that they see, jumps.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "hal/sim/ur_controller/script/code.hpp"
#include "hal/sim/ur_controller/script/names.hpp"
#include "hal/sim/ur_controller/script/token_cursor.hpp"

namespace firstlook::sim::ur::script {

class CodeWriter {
 public:
  /// Adds to `code`. Instructions have the place of the token that `tokens` is at; both must outlive the writer.
  /// @param interpreted  the first function is a line of statements, which runs in another function's frame
  CodeWriter(TokenCursor& tokens, Code& code, bool interpreted)
      : tokens_(tokens), code_(code), interpreted_(interpreted) {}

  // --- names ---
  void declare_functions(const Names& names);
  /// What is compiled into the code later may call them.
  void keep_functions();
  [[nodiscard]] bool is_function(const std::string& name) const;
  [[nodiscard]] std::vector<std::string> parameters_of(const std::string& function) const;
  void declare_global(const std::string& name);
  int declare_local(const std::string& name);
  /// Names a variable where the compiler is.
  [[nodiscard]] bool is_variable(const std::string& name) const;

  // --- functions, one within the other ---
  void begin_function(const std::string& name, bool top);
  int end_function();
  [[nodiscard]] Function& function() { return scopes_.back().function; }
  [[nodiscard]] std::size_t depth() const { return scopes_.size(); }
  [[nodiscard]] bool interpreted() const { return interpreted_; }
  [[nodiscard]] bool in_statement_line() const { return interpreted_ && scopes_.size() == 1; }
  /// Its number, of this script or of the one that it is compiled into.
  [[nodiscard]] int called_number(const std::string& function);

  /// There is nothing of that name.
  void fail_name(const Token& name);

  // --- instructions ---
  int emit(Op op, int a = 0, int b = 0) { return emit_at(tokens_.now(), op, a, b); }
  int emit_at(const Token& where, Op op, int a = 0, int b = 0);
  void constant(Value value);
  void load(const Token& name);
  void store(const Token& name, bool global, bool local);
  /// Where the variable is that elements are set in: a local's number, or ~number of a global.
  [[nodiscard]] int slot_of(const Token& name, bool global, bool local);
  [[nodiscard]] int here() const { return static_cast<int>(scopes_.back().function.instructions.size()); }
  /// A jump that was written before leads here.
  void aim(int instruction);

  /// What `write` writes, to be put somewhere later.
  template <typename Write>
  [[nodiscard]] std::vector<Instruction> apart(const Write& write) {
    const int begin = here();
    write();
    return cut(begin);
  }
  void append(const std::vector<Instruction>& instructions);

  // --- loops ---
  void begin_loop();
  /// Jumps back to its begin; those who left it land behind.
  void end_loop();
  /// False where there is none to leave or to repeat.
  [[nodiscard]] bool leave_loop();
  [[nodiscard]] bool repeat_loop();

 private:
  struct Loop {
    int begin = 0;
    std::vector<int> exits;
  };
  struct Scope {
    Function function;
    bool top = false;
    int number = 0;
    std::map<std::string, int> locals;
    std::vector<Loop> loops;
  };

  /// Of a function of this script; the same whether it is called first or defined.
  int function_number(const std::string& name, bool top);
  [[nodiscard]] std::vector<Instruction> cut(int begin);

  TokenCursor& tokens_;
  Code& code_;
  bool interpreted_;
  std::vector<Scope> scopes_;
  std::map<std::string, int> function_numbers_;                 ///< of the functions of this script
  std::map<std::string, std::vector<std::string>> parameters_;  ///< and their parameters
  std::size_t written_ = 0;
};

}  // namespace firstlook::sim::ur::script
