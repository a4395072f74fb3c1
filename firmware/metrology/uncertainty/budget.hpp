#pragma once
#include <span>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/uncertainty/known_quantities.hpp"

namespace probebox::metrology {

// Solves a dataset with its whole uncertainty: every stated type B input is propagated by solving again with the input
// slightly higher and lower. Adds the budget, the combined uncertainty of every promised value, and of others where an
// input is in no sd, unobservable quantities and conditions. Refuses what the solver and typeBInputs refuse;
// no-convergence when the solver refuses both neighbours of an input. further: inputs that the case does not state.
Solved withUncertainty(const Dataset& dataset, const Method& method, StoreReader store = nullptr,
                       std::span<const TypeBInput> further = {});

}  // namespace probebox::metrology
