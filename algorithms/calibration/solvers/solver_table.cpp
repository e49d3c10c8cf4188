#include "algorithms/calibration/solvers/solver_table.hpp"

#include <fmt/format.h>

#include <array>

#include "algorithms/calibration/solvers/solvers.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr auto kAxXb = SolverEquation::kAxXb;
constexpr auto kAxYb = SolverEquation::kAxYb;
constexpr auto kClosed = SolverForm::kClosed;
constexpr auto kNonlinear = SolverForm::kNonlinear;
constexpr std::string_view kWrist = "turning about one point (a wrist alone)";

// clang-format off
constexpr std::array kTable = {
    SolverRow{Solver::kShiuAhmad, "shiu-ahmad", "Shiu and Ahmad", 1987, kAxXb, kClosed, 3, 2, true,
              "rotation axes and the turn about them, least squares", "", solvers::shiu_ahmad},
    SolverRow{Solver::kTsaiLenz, "tsai-lenz", "Tsai and Lenz", 1989, kAxXb, kClosed, 3, 2, true,
              "modified Rodrigues vectors", "", solvers::tsai_lenz},
    SolverRow{Solver::kZhuangRoth, "zhuang-roth", "Zhuang and Roth", 1991, kAxXb, kClosed, 3, 2, true,
              "quaternions divided by their scalar; half turns too", "", solvers::zhuang_roth},
    SolverRow{Solver::kChouKamel, "chou-kamel", "Chou and Kamel", 1991, kAxXb, kClosed, 3, 2, true,
              "unit quaternion as singular vector", "", solvers::chou_kamel},
    SolverRow{Solver::kWang, "wang", "Wang, second method", 1992, kAxXb, kClosed, 3, 2, true,
              "axis perpendicular to differences of axes, then the angle", "", solvers::wang},
    SolverRow{Solver::kParkMartin, "park-martin", "Park and Martin", 1994, kAxXb, kClosed, 3, 2, true,
              "rotation vectors aligned, least squares on SO(3)", "", solvers::park_martin},
    SolverRow{Solver::kHoraudDornaika, "horaud-dornaika", "Horaud and Dornaika", 1995, kAxXb, kClosed, 3, 2, true,
              "axes aligned by a unit quaternion", "", solvers::horaud_dornaika},
    SolverRow{Solver::kHoraudDornaikaNonlinear, "horaud-dornaika-nonlinear", "Horaud and Dornaika", 1995, kAxXb,
              kNonlinear, 3, 2, true, "axes and translations together", "", solvers::horaud_dornaika_nonlinear},
    SolverRow{Solver::kLiBetsis, "li-betsis", "Li and Betsis", 1995, kAxXb, kClosed, 3, 2, true,
              "screw axes as canonical matrices, 12 unknowns", "", solvers::li_betsis},
    SolverRow{Solver::kLiBetsisNonlinear, "li-betsis-nonlinear", "Li and Betsis", 1995, kAxXb, kNonlinear, 3, 2, true,
              "Frobenius norm of AX - XB", "", solvers::li_betsis_nonlinear},
    SolverRow{Solver::kDaniilidis, "daniilidis", "Daniilidis", 1999, kAxXb, kClosed, 3, 2, true,
              "dual quaternions", "", solvers::daniilidis},
    SolverRow{Solver::kAndreff, "andreff", "Andreff, Horaud and Espiau", 2001, kAxXb, kClosed, 3, 2, true,
              "Kronecker products, 12 unknowns", kWrist, solvers::andreff},
    SolverRow{Solver::kZhuang, "zhuang", "Zhuang, Roth and Sudhakar", 1994, kAxYb, kClosed, 3, 2, true,
              "quaternions divided by a scalar, 6 unknowns", "", solvers::zhuang},
    SolverRow{Solver::kDornaikaHoraud, "dornaika-horaud", "Dornaika and Horaud", 1998, kAxYb, kClosed, 3, 2, true,
              "two unit quaternions as singular vectors", "", solvers::dornaika_horaud},
    SolverRow{Solver::kDornaikaHoraudNonlinear, "dornaika-horaud-nonlinear", "Dornaika and Horaud", 1998, kAxYb,
              kNonlinear, 3, 2, true, "both transforms, Frobenius norm", "", solvers::dornaika_horaud_nonlinear},
    SolverRow{Solver::kLi, "li", "Li, Wang and Wu", 2010, kAxYb, kClosed, 3, 2, true,
              "Kronecker products, 24 unknowns", kWrist, solvers::li},
    SolverRow{Solver::kQr24, "qr24", "Ernst et al.", 2012, kAxYb, kClosed, 3, 2, true,
              "24 free numbers, mm", kWrist, solvers::qr24},
    SolverRow{Solver::kQr24Preconditioned, "qr24-preconditioned", "Ernst et al.", 2012, kAxYb, kClosed, 3, 2, true,
              "24 free numbers, translations scaled to weigh as rotations", kWrist, solvers::qr24_preconditioned},
    SolverRow{Solver::kQr15, "qr15", "Ernst et al.", 2012, kAxYb, kClosed, 5, 2, false,
              "15 free numbers, from board positions alone",
              "turning about one point; boards seen in one plane of the camera", solvers::qr15},
    SolverRow{Solver::kShah, "shah", "Shah", 2013, kAxYb, kClosed, 3, 2, true,
              "Kronecker product, singular vectors", "", solvers::shah},
};
// clang-format on

constexpr auto kNames = [] {
  std::array<std::string_view, kTable.size()> names;
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = kTable[i].name;
  return names;
}();

constexpr bool in_order = [] {
  for (std::size_t i = 0; i < kTable.size(); ++i) {
    if (kTable[i].solver != static_cast<Solver>(i)) return false;
  }
  return true;
}();
static_assert(in_order, "the table has the order of the enumeration");

}  // namespace

std::span<const SolverRow> solver_table() { return kTable; }

const SolverRow& solver_row(Solver solver) {
  const auto index = static_cast<std::size_t>(solver);
  ENSURE(2301, index < kTable.size());
  return kTable[index];
}

std::optional<Solver> find_solver(std::string_view name) {
  for (const SolverRow& row : kTable) {
    if (name == row.name) return row.solver;
  }
  return std::nullopt;
}

std::string_view solver_name(Solver solver) { return solver_row(solver).name; }

std::span<const std::string_view> solver_names() { return kNames; }

std::string solver_table_markdown() {
  std::string text =
      "| `--solver` | paper | equation, form | views, axes | method | cannot take |\n"
      "|---|---|---|---|---|---|\n";
  for (const SolverRow& row : kTable) {
    text += fmt::format("| `{}` | {} {} | {}, {} | {}, {} | {} | {} |\n", row.name, row.paper, row.year,
                        row.equation == kAxXb ? "AX = XB" : "AX = YB", row.form == kClosed ? "closed" : "nonlinear",
                        row.poses_min, row.axes_min, row.method, row.cannot_take);
  }
  return text;
}

}  // namespace firstlook
