#pragma once
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/request.hpp"

namespace probebox::command {

// Each runs one command, in commands/<name>.cpp. uri: the value of -u, or empty.
ExitStatus run(const List& options, const std::string& uri, Console& console);
ExitStatus run(const Info& options, const std::string& uri, Console& console);
ExitStatus run(const Status& options, const std::string& uri, Console& console);
ExitStatus run(const Metrics& options, const std::string& uri, Console& console);
ExitStatus run(const Watch& options, const std::string& uri, Console& console);
ExitStatus run(const Record& options, const std::string& uri, Console& console);
ExitStatus run(const Export& options, const std::string& uri, Console& console);
ExitStatus run(const Verify& options, const std::string& uri, Console& console);
ExitStatus run(const Replay& options, const std::string& uri, Console& console);
ExitStatus run(const Pack& options, const std::string& uri, Console& console);
ExitStatus run(const Unpack& options, const std::string& uri, Console& console);
ExitStatus run(const Clock& options, const std::string& uri, Console& console);
ExitStatus run(const Solve& options, const std::string& uri, Console& console);
ExitStatus run(const Report& options, const std::string& uri, Console& console);
ExitStatus run(const Calibrate& options, const std::string& uri, Console& console);
ExitStatus run(const Plan& options, const std::string& uri, Console& console);
ExitStatus run(const Gcode& options, const std::string& uri, Console& console);
ExitStatus run(const Selftest& options, const std::string& uri, Console& console);
ExitStatus run(const Propose& options, const std::string& uri, Console& console);
ExitStatus run(const Accept& options, const std::string& uri, Console& console);
ExitStatus run(const Rollback& options, const std::string& uri, Console& console);
ExitStatus run(const Results& options, const std::string& uri, Console& console);
ExitStatus run(const Show& options, const std::string& uri, Console& console);
ExitStatus run(const Home& options, const std::string& uri, Console& console);
ExitStatus run(const History& options, const std::string& uri, Console& console);
ExitStatus run(const Corrections& options, const std::string& uri, Console& console);
ExitStatus run(const Inhibit& options, const std::string& uri, Console& console);
ExitStatus run(const Interference& options, const std::string& uri, Console& console);
ExitStatus run(const Provision& options, const std::string& uri, Console& console);
ExitStatus run(const FactoryTest& options, const std::string& uri, Console& console);
ExitStatus run(const Certificate& options, const std::string& uri, Console& console);
ExitStatus run(const Update& options, const std::string& uri, Console& console);
// In tools/probebox/view, which may be left out of a build.
ExitStatus run(const View& options, const std::string& uri, Console& console);

}  // namespace probebox::command
