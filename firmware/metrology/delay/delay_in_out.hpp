#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "delay-in-out": system delay tau = tau_machine - tau_probe (A1) from drives onto one point and straight back,
// without a rest (CN101622513, docs/metrology.md A.8). Starts from the apexes of the two streams (A18); then compares
// the streams over the whole contact, without the ringing of the stylus since contact (A19). Needs no knowledge of
// surface or size. Tables machine, probe, touches. Config: previous_tau_s; probe_kind (deflection, distance:
// then table probe has the column distance_mm). Gives tau_s. Refuses what readTouches and matchWaveforms refuse;
// no-contact, truncated, gap (any sample of the contact missing), flat-apex (a rest of more than a fifth of the
// contact), clipped, residual-too-large.
Outcome<Result, Refusal> solveDelayInOut(const Dataset& dataset);

extern const Method kDelayInOut;

}  // namespace probebox::metrology
