/// The hand-eye solvers by name: --solver, its help, the configuration and the documentation come from this table.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "algorithms/calibration/solvers/problem.hpp"

namespace firstlook {

enum class Solver : std::uint8_t {
  kShiuAhmad,
  kTsaiLenz,
  kZhuangRoth,
  kChouKamel,
  kWang,
  kParkMartin,
  kHoraudDornaika,
  kHoraudDornaikaNonlinear,
  kLiBetsis,
  kLiBetsisNonlinear,
  kDaniilidis,
  kAndreff,
  kZhuang,
  kDornaikaHoraud,
  kDornaikaHoraudNonlinear,
  kLi,
  kQr24,
  kQr24Preconditioned,
  kQr15,
  kShah,
};

/// AX = XB: motions between views, flange_T_camera alone. AX = YB: views as they are, base_T_board too.
enum class SolverEquation : std::uint8_t { kAxXb, kAxYb };
enum class SolverForm : std::uint8_t { kClosed, kNonlinear };

struct SolverRow {
  Solver solver;
  std::string_view name;  ///< what --solver takes
  std::string_view paper;
  int year;
  SolverEquation equation;
  SolverForm form;
  int poses_min;
  int axes_min;                  ///< independent rotation axes of the flange
  bool board_rotation;           ///< false: the board's position in the camera is enough
  std::string_view method;       ///< in a few words
  std::string_view cannot_take;  ///< beyond fewer poses and axes; empty: nothing
  Result<HandEyeSolution> (*solve)(const solvers::Problem&);
};

/// All solvers: AX = XB by year, then AX = YB by year.
[[nodiscard]] std::span<const SolverRow> solver_table();
[[nodiscard]] const SolverRow& solver_row(Solver solver);

/// Empty for a name that is not in the table.
[[nodiscard]] std::optional<Solver> find_solver(std::string_view name);
[[nodiscard]] std::string_view solver_name(Solver solver);
/// Every name, in the table's order.
[[nodiscard]] std::span<const std::string_view> solver_names();

/// The table as it stands in the folder's README.
[[nodiscard]] std::string solver_table_markdown();

}  // namespace firstlook
