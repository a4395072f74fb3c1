#include "firmware/app/threads/feed.hpp"

namespace probebox::app {

messages::GapReason wireReason(latch::LostReason reason) {
  switch (reason) {
    case latch::LostReason::clock:
      return messages::GapReason::source_clock;
    case latch::LostReason::probe:
      return messages::GapReason::source_probe;
    case latch::LostReason::encoders:
      return messages::GapReason::source_encoders;
  }
  return messages::GapReason::source_clock;
}

}  // namespace probebox::app
