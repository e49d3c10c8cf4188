/// A compiled script: functions as instructions for a stack machine.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "hal/sim/ur_controller/script/value.hpp"

namespace firstlook::sim::ur::script {

enum class Op : std::uint8_t {
  kConstant,     ///< push constants[a]
  kLoadLocal,    ///< push local a
  kStoreLocal,   ///< pop into local a
  kLoadGlobal,   ///< push global a
  kStoreGlobal,  ///< pop into global a
  kIndex,        ///< container, a indices -> element; a member is the index of its name
  kSetElement,   ///< a indices, value: into the variable in slot b
  kNegate,
  kNot,
  kBinary,           ///< a: a BinaryOp
  kJump,             ///< to a
  kJumpIfFalse,      ///< pops
  kJumpIfFalseKeep,  ///< of `and`: leaves the value when it jumps
  kJumpIfTrueKeep,   ///< of `or`
  kJumpIfSet,        ///< to a, when local b has a value
  kPop,
  kMakeList,     ///< of a values
  kMakePose,     ///< of six
  kCall,         ///< functions[a] with b arguments
  kCallBuiltin,  ///< builtins[a] with b arguments
  kReturn,       ///< the value on top
  kRun,          ///< a thread of functions[a]: pushes its handle
  kJoin,         ///< pops a handle; waits
  kKill,         ///< pops a handle
  kHalt,
  kEnterCritical,
  kExitCritical,
  kInterpret,     ///< runs what comes to the interpreter port, until that ends
  kEndStatement,  ///< of it: back to kInterpret, in the frame of which it ran
};

enum class BinaryOp : std::uint8_t {
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kModulo,
  kEqual,
  kNotEqual,
  kLess,
  kLessOrEqual,
  kGreater,
  kGreaterOrEqual,
  kXor,
};

struct Instruction {
  Op op = Op::kHalt;
  int a = 0, b = 0;
  int line = 0, column = 0;
};

struct Function {
  std::string name;
  int parameters = 0;
  std::vector<std::string> locals;  ///< their names; the parameters come first
  bool thread = false;
  std::vector<Instruction> instructions;
};

struct Code {
  std::string name;        ///< of the program: its `def`; "unnamed" for single lines
  bool secondary = false;  ///< `sec`: runs beside the program, without moving the arm
  std::vector<Function> functions;
  int main = 0;  ///< among the functions
  std::vector<Value> constants;
  std::vector<std::string> globals;
  // What is compiled into it later may use these names.
  std::map<std::string, int> function_numbers, global_numbers;
};

}  // namespace firstlook::sim::ur::script
