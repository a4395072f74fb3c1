#pragma once

// Conditions on how a value of a fields() list is shown as JSON; its bytes and its register do not depend on them.
namespace probebox::published {

// null unless the condition holds: the value is not known.
struct NullUnless {
  bool condition{};
};
// Without its key unless the condition holds: the box has no such part.
struct OmittedUnless {
  bool condition{};
};

}  // namespace probebox::published
