#include "platform/core/result.hpp"

#include <string>

namespace firstlook {

std::string describe(const Error& error) {
  const FaultRow& row = fault_row(error.fault);
  return fmt::format("E{} {}: {}\n      {}", static_cast<int>(error.fault), row.text, error.detail(), row.remedy);
}

}  // namespace firstlook
