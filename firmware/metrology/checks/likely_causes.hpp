#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"

// Which ordinary error leaves residuals such as those of a case: one of the machine's own (kMachineErrors), three lobes
// of the probe, or a stated size that is off. Each is put into the readings, and the case solved again; what it changes
// the residuals by is fitted to them. An F test tells whether it explains them, and the likelihood which do so about as
// well as the best; all of these are named.
namespace probebox::metrology {

// As the sentence calls a cause: a key of kMachineErrors, kLobing, kCurvature, or the key of a stated size.
std::string causeName(std::string_view cause);

// Sentence; nothing where no error explains the residuals, or none are there. sigma_mm: noise of
// a reading as it is stated; 0: unknown.
std::optional<std::string> likelyCauses(const Dataset& dataset, const Method& method, double sigma_mm);

// Adds it to the first warning that says that the readings contradict the model or their noise. dataset: as it was
// solved, mended.
void nameLikelyCauses(const Dataset& dataset, const Method& method, Result& result);

}  // namespace probebox::metrology
