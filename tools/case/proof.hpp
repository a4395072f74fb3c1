#pragma once
#include "firmware/metrology/dataset/verdict.hpp"

namespace probebox::casefolder {

// "FAIL: beyond the limit by more than U". warned: of one that conforms, but whose result has a warning.
constexpr const char* proofInWords(metrology::Proof proof, bool warned) {
  switch (proof) {
    case metrology::Proof::conforms:
      return warned ? "WARN: within the limits, but with a warning" : "PASS: within the limits, with U";
    case metrology::Proof::not_proven:
      return "NOT PROVEN: the limit lies within U, or U is unknown";
    case metrology::Proof::fails:
      return "FAIL: beyond the limit by more than U";
  }
  return "";
}

}  // namespace probebox::casefolder
