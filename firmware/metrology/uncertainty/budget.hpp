#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/uncertainty/known_quantities.hpp"

namespace probebox::metrology {

using Solver = Solved (*)(const Dataset&);

// What the solver answers, with the whole uncertainty: every type B input that the case states is propagated by solving
// again with the input a little higher and a little lower, so nothing is linearised by hand. Adds the budget, the
// combined uncertainty of every promised value, what the data cannot observe, and the conditions.
// Refuses what the solver and typeBInputs refuse; no-convergence when the solver refuses both neighbours of an input.
Solved withUncertainty(const Dataset& dataset, Solver solver, StoreReader store = nullptr);

}  // namespace probebox::metrology
