#include "firmware/app/log.hpp"

#include <cstdio>
#include <cstdlib>
#include <string>
#include <systemd/sd-daemon.h>

namespace probebox::app {
namespace {

void logLine(const char* priority, std::string_view text) {
  // systemd sets JOURNAL_STREAM for services whose stderr it reads; a person needs no prefix.
  static const bool for_journal = std::getenv("JOURNAL_STREAM") != nullptr;
  std::string line{for_journal ? priority : ""};
  line.append("probeboxd: ").append(text).append("\n");
  std::fputs(line.c_str(), stderr);
}

}  // namespace

void logInfo(std::string_view text) {
  logLine(SD_INFO, text);
}
void logWarning(std::string_view text) {
  logLine(SD_WARNING, text);
}
void logError(std::string_view text) {
  logLine(SD_ERR, text);
}

}  // namespace probebox::app
