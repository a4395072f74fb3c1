#pragma once
#include <vector>

#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {

// The touches without what still rings in the stylus from the moment of contact. While the machine rests at the apex
// the probe shows c + exp(-t/T) (a cos wt + b sin wt); w and T are the stylus' own and common to all touches, the
// amplitudes belong to each. What rings in the rest rings on into the retract, where it would pull on the line, always
// to the same side: it is taken out from the rest to the separation (docs/metrology.md A.3). Touches whose rest is too
// short, and all of them where the rests hold no more than noise, come back as they are.
std::vector<Touch> withoutRinging(std::vector<Touch> touches);

}  // namespace probebox::metrology
