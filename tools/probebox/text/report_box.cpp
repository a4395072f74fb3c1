#include <array>
#include <initializer_list>

#include "firmware/metrology/dataset/quantity.hpp"
#include "tools/case/readable.hpp"
#include "tools/probebox/cli/json_of.hpp"
#include "tools/probebox/text/due.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/report_front_end.hpp"

namespace probebox::command {
namespace {

namespace quantity = metrology::quantity;

using std::to_string;

Json channelsOf(const messages::Descriptor& descriptor) {
  Json channels = Json::array();
  for (const auto& channel : descriptor.channels) {
    channels.push_back({{"name", channel.name},
                        {"unit", channel.unit},
                        {"unit_per_count", channel.scale},
                        {"width_bytes", channel.bytes},
                        {"signed", channel.is_signed},
                        {"about", channel.doc}});
  }
  return channels;
}

std::string row(const std::string& name, const std::string& value) {
  return printed("%-18s %s\n", name.c_str(), value.c_str());
}

std::string channelRow(const messages::ChannelDescription& channel) {
  const std::string unit = channel.unit.empty() ? "-" : printed("%g %s", channel.scale, channel.unit.c_str());
  return printed("  %-16s %-10s %s\n", channel.name.c_str(), unit.c_str(), channel.doc.c_str());
}

std::string receiverText(const messages::ReceiverStatus& r) {
  std::string all{messages::nameOf(r.state)};
  const bool is_good = r.state == ClockState::locked || r.state == ClockState::holdover;
  if (is_good) all += ", sigma " + readableNs(r.sigma_ns) + printed(", %+.3f ppm", r.frequency_ppb * 1e-3);
  all += ", " + to_string(r.samples) + " samples, " + to_string(r.missing) + " missing, " + to_string(r.unstamped) +
         " before the clock was locked";
  if (r.bad_packets > 0) all += ", " + to_string(r.bad_packets) + " bad packets";
  const bool never_locked = r.samples == r.unstamped;
  if (never_locked && r.refused_frequency > 0) all += "; check that rate_hz in probe.toml is that of the receiver";
  return all;
}

std::string secondReceiverText(const messages::SecondReceiverStatus& r) {
  std::string all{messages::nameOf(r.state)};
  const bool is_good = r.state == ClockState::locked || r.state == ClockState::holdover;
  if (is_good)
    all +=
        ", sigma " + readableNs(r.sigma_ns) + printed(" among the first's samples, %+.3f ppm", r.frequency_ppb * 1e-3);
  all += ", " + to_string(r.samples) + " samples, " + to_string(r.missing) + " missing, " + to_string(r.unstamped) +
         " without a time; sync edges: " + to_string(r.matched) + " on both, " + to_string(r.unmatched) +
         " on it alone, " + to_string(r.unseen) + " on the first alone, " + to_string(r.misfits) + " apart";
  if (r.restarts > 0) all += "; " + to_string(r.restarts) + " restarts";
  if (r.bad_packets > 0) all += ", " + to_string(r.bad_packets) + " bad packets";
  if (r.matched == 0)
    all += "; no sync edge has come on both: wire the sync line to both receivers, and plug both into one hub";
  return all;
}

std::string delayOf(const messages::DelayInForce& delay) {
  if (delay.result_id == 0) return "not calibrated (probebox calibrate)";
  const auto tau = casefolder::labelOf(quantity::kTau.key);
  std::string all;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool is_known = delay.sd_s[axis] > 0;
    all += std::string{"XYZ"[axis]} + " " +
           (is_known ? casefolder::withUncertainty(tau, delay.tau_s[axis], delay.sd_s[axis]) : "never measured") + "  ";
  }
  return all + "(result " + to_string(delay.result_id) + ")";
}

std::string edgesOf(const messages::EdgeCounters& edges) {
  return to_string(edges.accepted) + " accepted, " + to_string(edges.missing) + " missing, " +
         to_string(edges.doubled) + " doubled, " + to_string(edges.spurious) + " spurious, " + to_string(edges.lost) +
         " lost by the kernel, " + to_string(edges.unlocked) + " before the lock";
}

std::uint64_t badFrames(const messages::LinkCounters& link) {
  return link.bad_crc + link.bad_cobs + link.bad_length + link.oversize;
}

std::string samplesOf(const messages::Ledger& ledger) {
  return to_string(ledger.produced) + " produced, " + to_string(ledger.lost_at_source + ledger.lost_in_queue) +
         " of them lost: " + to_string(ledger.lost_at_source) + " at the source, " + to_string(ledger.lost_in_queue) +
         " on the way out";
}

std::string hostsOf(const messages::LinkCounters& link) {
  return to_string(link.frames) + " good frames, " + to_string(badFrames(link)) + " bad ones, " +
         to_string(link.discarded_bytes) + " bytes of garbage";
}

std::string duration(std::uint64_t ms) {
  const auto s = ms / 1000;
  if (s < 60) return to_string(s) + " s";
  if (s < 3600) return to_string(s / 60) + " min " + to_string(s % 60) + " s";
  return to_string(s / 3600) + " h " + to_string(s / 60 % 60) + " min";
}

Json linesOf(const std::vector<messages::LineStatus>& lines) {
  constexpr std::array kRoles{"sync", "trigger", "index", "skip", "inhibit"};
  Json all = Json::array();
  for (const auto& line : lines) {
    Json object = jsonOf(line);
    object["role"] = line.role < kRoles.size() ? kRoles[line.role] : "unknown";
    all.push_back(std::move(object));
  }
  return all;
}

void addStorage(const messages::Status::Answer& s, std::string& all) {
  for (const auto& holder : s.inhibits) all += row("a cut is on", line(holder));
  for (const auto& sentence : s.rests_on_retired) all += row("repeat", sentence);
  for (const auto& problem : s.storage_problems) all += row("storage", problem);
  if (!s.update.empty()) all += row("update", s.update);
}

std::string cncLineText(const messages::CncLineStatus& line) {
  return line.name + ": " + to_string(line.answered) + " requests answered, " + to_string(line.refused) + " refused, " +
         to_string(line.bad_frames) + " bad frames of " + to_string(line.skipped_bytes) + " bytes, " +
         to_string(line.unsent) + " answers not sent, opened again " + to_string(line.reopened) + " times";
}

std::string usbPortText(const messages::UsbPortStatus& port) {
  if (!port.problem.empty()) return "not on the bus: " + port.problem;
  return to_string(port.connections) + " connections, " + to_string(port.suspensions) + " times asleep, " +
         to_string(port.failed_transfers) + " failed transfers, " + to_string(port.discarded_bytes) +
         " bytes discarded as hosts left";
}

// Empty when nothing was: a page names what is wrong.
std::string unusedText(const messages::EventCounts& unused) {
  std::string all;
  const auto add = [&all](std::uint64_t count, const char* what) {
    if (count != 0) all += (all.empty() ? "" : ", ") + to_string(count) + " " + what;
  };
  add(unused.late, "late");
  add(unused.disordered, "disordered");
  add(unused.overwritten, "overwritten");
  add(unused.incomplete_rows, "rows without all axes");
  add(unused.stray_markers, "stray markers");
  return all;
}

// Empty when everybody was.
std::string notLetInText(const messages::NotLetIn& n) {
  if (n.strangers + n.silent + n.turned_away == 0) return {};
  return to_string(n.strangers) + " began with something else than HELLO, " + to_string(n.silent) +
         " said nothing in time, " + to_string(n.turned_away) + " were told why";
}

std::string resultsOf(const std::vector<std::uint64_t>& ids) {
  std::string all;
  for (const auto id : ids) all += (all.empty() ? "" : ", ") + to_string(id);
  return all.empty() ? "none" : all;
}

// As much of an answer as a recording holds.
messages::Status::Answer answerOf(const RecordedStatus& r) {
  messages::Status::Answer s;
  if (r.descriptor) {
    s.board = r.descriptor->board;
    s.firmware_version = r.descriptor->firmware_version;
  }
  if (r.map) {
    s.clock.tick = r.map->tick;
    s.clock.state = r.map->state;
    s.clock.sigma_ns = r.map->sigma_ns;
  }
  if (r.beat) {
    s.uptime_ms = r.beat->uptime_ms;
    s.clock.state = r.beat->clock_state;
    s.clock.sigma_ns = r.beat->clock_sigma_ns;
    s.clock.edges = r.beat->edges;
    s.ledger = {r.beat->produced, r.beat->lost_at_source, r.beat->lost_in_queue};
    s.deadline_misses = r.beat->deadline_misses;
    s.from_hosts = r.beat->link;
  }
  return s;
}

}  // namespace

std::string readableNs(double ns) {
  if (ns < 1e4) return printed("%.0f ns", ns);
  if (ns < 1e7) return printed("%.1f us", ns * 1e-3);
  if (ns < 1e10) return printed("%.1f ms", ns * 1e-6);
  return printed("%.1f s", ns * 1e-9);
}

Json describe(const messages::Descriptor& d) {
  return {{"board", d.board},
          {"serial_number", d.serial_number},
          {"firmware_version", d.firmware_version},
          {"machine", d.machine},
          {"probe", d.probe},
          {"nominal_tick_period_ns", d.nominal_tick_period_ns},
          {"samples_per_tick", d.samples_per_tick},
          {"gain_nm_per_nm", d.gain},
          {"delay",
           {{"calibrated", d.delay.calibrated},
            {"tau_s", d.delay.tau_s},
            {"sd_s", d.delay.sd_s},
            {"result_id", d.delay.result_id}}},
          {"tip",
           {{"has_deflection", d.tip.has_deflection},
            {"turned", d.tip.turned},
            {"referenced_axes", d.tip.referenced},
            {"offset_mm", d.tip.offset_mm},
            {"screw_mm", d.tip.screw_mm},
            {"screw_mm_per_mm", d.tip.screw_slope},
            {"ball_radius_mm", d.tip.ball_radius_mm},
            {"noise_nm", d.tip.noise_nm},
            {"gain_result_id", d.tip.gain_result_id},
            {"gain_sd", d.tip.gain_sd}}},
          {"channels", channelsOf(d)}};
}

std::string page(const messages::Descriptor& d) {
  std::string all = row("board", d.board) + row("serial number", d.serial_number) +
                    row("firmware", d.firmware_version) + row("machine", d.machine) + row("probe", d.probe);
  all += row("master clock", printed("%g us per tick, %u samples per tick: %g samples per second",
                                     static_cast<double>(d.nominal_tick_period_ns) * 1e-3,
                                     static_cast<unsigned>(d.samples_per_tick), d.samplesPerSecond()));
  all += row("system delay", delayOf(d.delay)) + "channels\n";
  for (const auto& channel : d.channels) all += channelRow(channel);
  all.pop_back();
  return all;
}

void addFrontEnd(const std::string& name, const messages::FrontEndStatus& front_end, std::string& all) {
  if (!front_end.isThere()) return;
  const auto& scale = front_end.full_scale_um;
  auto text = identityOf(front_end);
  if (!front_end.version.empty())
    text += printed(", %.2f samples/s, full scale %g %g %g um, sync out %.6g Hz", front_end.rate_hz, scale[0], scale[1],
                    scale[2], front_end.sync_out_hz);
  all += row(name, text);
  if (!front_end.lacks.empty()) all += row(name + " lacks", front_end.lacks);
  if (front_end.pins.empty()) return;
  std::string pins;
  for (const auto& pin : front_end.pins) pins += (pins.empty() ? "" : ", ") + pin.name + " " + to_string(pin.gpio);
  all += row(name + " pins", pins);
}

Json describe(const messages::Status::Answer& s) {
  Json all = jsonOf(s);
  all["lines"] = linesOf(s.lines);
  all["from_hosts"]["bad_frames"] = badFrames(s.from_hosts);
  return all;
}

std::string page(const messages::Status::Answer& s) {
  std::string all = row("box", s.board + ", firmware " + s.firmware_version + ", up " + duration(s.uptime_ms));
  if (!s.utc.empty()) all += row("date", s.utc + (s.date_source.empty() ? "" : ", " + s.date_source));
  all += row("master clock", std::string{messages::nameOf(s.clock.state)} + ", sigma " + readableNs(s.clock.sigma_ns) +
                                 printed(", %+.3f ppm, tick ", s.clock.frequency_ppb * 1e-3) +
                                 to_string(s.clock.tick.index));
  all += row("sync edges", edgesOf(s.clock.edges));
  if (s.receiver.samples > 0) all += row("probe receiver", receiverText(s.receiver));
  addFrontEnd("front end", s.front_end, all);
  if (s.second_receiver.samples > 0) all += row("second receiver", secondReceiverText(s.second_receiver));
  addFrontEnd("front end 2", s.second_front_end, all);
  all += row("samples", samplesOf(s.ledger));
  all += row("events", to_string(s.events.received) + " received, " + to_string(s.events.lost) + " lost, " +
                           to_string(s.events.lost_in_queue) + " found no room in the queue, at most " +
                           to_string(s.queue_high_water) + " deep");
  if (const auto unused = unusedText(s.events); !unused.empty()) all += row("unused events", unused);
  if (s.events.lost_in_journal != 0)
    all += row("journal", to_string(s.events.lost_in_journal) + " events are missing in it");
  for (const auto& source : s.sources) {
    if (!source.problem.empty()) all += row("nothing from", source.name + ": " + source.problem);
    if (!source.faults.empty()) all += row("fault of", source.name + ": " + source.faults);
    if (source.unusable != 0) all += row("unusable", source.name + ": " + to_string(source.unusable) + " messages");
  }
  if (s.events.sources_gone != 0) all += row("sources gone", to_string(s.events.sources_gone) + " times");
  for (const auto& line : s.lines) {
    all += row("line", line.name + ": " + to_string(line.edges) + " edges, " + to_string(line.lost) + " lost");
  }
  all += row("late ticks", to_string(s.deadline_misses));
  all += row("procedure", s.procedure.empty() ? "none" : s.procedure);
  all += row("results in force", resultsOf(s.active_results));
  for (const auto& due : s.due) all += row("due", due.name + ": " + dueText(due));
  addStorage(s, all);
  all += row("links", to_string(s.links) + " connected");
  if (const auto text = notLetInText(s.not_let_in); !text.empty()) all += row("not let in", text);
  if (!s.tls_problem.empty()) all += row("tls links", s.tls_problem);
  for (const auto& port : s.usb_ports) all += row("usb", usbPortText(port));
  all += row("from hosts", hostsOf(s.from_hosts));
  if (s.cnc_lines.empty())
    all += row("modbus",
               to_string(s.modbus.requests) + " requests answered, " + to_string(s.modbus.bad_frames) + " bad frames");
  for (const auto& line : s.cnc_lines) all += row("controller", cncLineText(line));
  all.pop_back();
  return all;
}

Json describe(const RecordedStatus& r) {
  const auto answer = answerOf(r);
  Json all = describe(answer);
  const auto not_recorded = [&all](std::initializer_list<const char*> keys) {
    for (const auto* key : keys) all[key] = nullptr;
  };
  not_recorded({"receiver", "queue_high_water_events", "events", "sources", "lines", "procedure", "links"});
  not_recorded(
      {"not_let_in", "modbus", "cnc_lines", "usb_ports", "unit", "process", "update", "storage_problems", "front_end"});
  not_recorded({"active_result_ids", "newest_results", "rests_on_retired", "inhibits", "cut_in_progress"});
  for (const auto* key : {"frequency_ppb", "absolute_sigma_ns"}) all["clock"][key] = nullptr;
  if (!r.map) all["clock"]["tick"] = nullptr;
  if (!r.beat) all["clock"]["edges"] = nullptr;
  if (!r.beat) not_recorded({"uptime_ms", "ledger", "deadline_misses", "from_hosts"});
  if (!r.beat && !r.map) not_recorded({"clock"});
  if (!r.descriptor) not_recorded({"board", "firmware_version"});
  all["delay"] = r.descriptor ? describe(*r.descriptor)["delay"] : Json(nullptr);
  all["recording"] = r.recording;
  return all;
}

std::string page(const RecordedStatus& r) {
  const auto s = answerOf(r);
  std::string all = row("recording", r.recording);
  if (r.descriptor) all += row("box", s.board + ", firmware " + s.firmware_version);
  if (r.beat || r.map)
    all +=
        row("master clock", std::string{messages::nameOf(s.clock.state)} + ", sigma " + readableNs(s.clock.sigma_ns));
  if (r.beat) {
    all += row("up", duration(s.uptime_ms)) + row("sync edges", edgesOf(s.clock.edges)) +
           row("samples", samplesOf(s.ledger)) + row("late ticks", to_string(s.deadline_misses)) +
           row("from this host", hostsOf(s.from_hosts));
  }
  if (r.descriptor) all += row("system delay", delayOf(r.descriptor->delay));
  all.pop_back();
  return all;
}

}  // namespace probebox::command
