#include "firmware/metrology/fit/student.hpp"

namespace probebox::metrology {

std::optional<double> varianceFromResiduals(double sum_of_squares, std::size_t dof) {
  if (dof <= 2) return std::nullopt;
  return sum_of_squares / static_cast<double>(dof - 2);
}

std::string noSdWarning(std::size_t dof, std::string_view key) {
  const std::string spare =
      dof == 0 ? "no more readings than unknowns"
               : "only " + std::to_string(dof) + " more readings than unknowns, but an sd needs three more";
  return "no sd: no " + std::string{key} + " is stated and there are " + spare + "; state " + std::string{key} +
         ", or take more readings";
}

}  // namespace probebox::metrology
