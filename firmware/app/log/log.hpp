#pragma once
#include <string_view>

namespace probebox::app {

// Lines to stderr, with the priority prefix that the journal understands when it is the one that reads. Not for the
// tick path.
void logInfo(std::string_view text);
void logWarning(std::string_view text);
void logError(std::string_view text);

// Written by the caller itself, past what waits for the worker: for the case that the worker stands still.
void logErrorAtOnce(std::string_view text);

void leaveLogToWorker();
void drainLog();
// At the end: what waits is written, and later lines are written where they arise.
void writeLogHere();

}  // namespace probebox::app
