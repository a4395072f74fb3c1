#include "tools/probebox/text/report.hpp"

namespace probebox::command {

std::string cutLine() {
  return printed("%-18s %s", "a cut is on",
                 "an inhibit line of the box is active, or gives no level: no result comes into force");
}

std::string line(const messages::InhibitHolder& holder) {
  return (holder.by.empty() ? holder.connection : holder.by) + ", since " + holder.since_utc;
}

}  // namespace probebox::command
