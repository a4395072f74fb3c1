#pragma once
#include <cstddef>
#include <optional>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/uncertainty/known_quantities.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Tables holder_store{holder_id,L1_mm,sd_mm} and tool_store{tool_id,L2_mm,sd_mm}: the lengths in store (CN103801980,
// docs/metrology.md (C4)). The keys holder_id and tool_id, numbers, choose a row of each, which then stands for L1_mm
// and L2_mm and their sd. A case without these tables comes back as it is. Refuses: missing-id (none stated, or not in
// the store), duplicated-id, bad-config (a length in the case and in the store), missing-key (measured_at_s, seconds
// since 1970, without which nothing can be written back), and what checkedTable does.
Outcome<Dataset, Refusal> withStoredLengths(const Dataset& dataset);

// Nothing where no store stands for the key, its sd is zero, or withStoredLengths would refuse.
std::optional<StoredLength> storedLength(const Dataset& dataset, std::string_view key);

// What goes back to the stores, with time, tool and holder: also motion_control_mm (W2x, W2y, L4) and simulation_mm
// (W1x, W1y, L3), tool_id, holder_id, measured_at_s. Nothing where the case has no stores.
void addStoreRecords(Result& result, const Dataset& dataset);

}  // namespace probebox::metrology
