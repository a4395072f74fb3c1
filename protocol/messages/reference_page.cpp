// Writes protocol/MESSAGES.md from the field lists. `messages_page` prints it; `messages_page --check FILE` fails when
// the file says something else.
#include <cstdio>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/codec/block.hpp"
#include "protocol/frame/frame.hpp"
#include "protocol/messages/cases.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/reference_table.hpp"
#include "protocol/messages/request.hpp"
#include "protocol/messages/stream.hpp"
#include "protocol/messages/structure_name.hpp"

namespace probebox::messages {
namespace {

// Tables of the structures inside messages, by name, for their own section.
std::map<std::string, std::string>& structureTables() {
  static std::map<std::string, std::string> tables;
  return tables;
}

template <class T>
std::string table();

template <class T>
std::string typeName() {
  if constexpr (std::same_as<T, bool>) {
    return "bool";
  } else if constexpr (std::same_as<T, double>) {
    return "f64";
  } else if constexpr (std::same_as<T, MonoTime> || std::same_as<T, Tick> || std::same_as<T, SampleIndex>) {
    return "i64";
  } else if constexpr (std::is_enum_v<T>) {
    return typeName<std::underlying_type_t<T>>();
  } else if constexpr (std::integral<T>) {
    return (std::is_signed_v<T> ? "i" : "u") + std::to_string(8 * sizeof(T));
  } else if constexpr (std::same_as<T, std::byte>) {
    return "byte";
  } else if constexpr (Text<T>) {
    return "text";
  } else if constexpr (Bytes<T>) {
    return "bytes";
  } else if constexpr (detail::kIsArray<T>) {
    return std::to_string(std::tuple_size_v<T>) + " x " + typeName<typename T::value_type>();
  } else if constexpr (detail::kIsVector<T>) {
    return "list of " + typeName<typename T::value_type>();
  } else {
    const auto name = structureName<T>();
    auto& tables = structureTables();
    if (!tables.contains(name)) {
      tables[name];  // one that holds itself would end here
      tables[name] = table<T>();
    }
    return name;
  }
}

template <class T>
std::string table() {
  std::string rows;
  const T value{};
  T::fields(value, [&](std::string_view name, const auto& member, std::string_view doc, auto&&...) {
    rows += "| `" + std::string{name} + "` | " + typeName<std::decay_t<decltype(member)>>() + " | " + std::string{doc} +
            " |\n";
  });
  return rows.empty() ? "Nothing.\n\n" : "| field | type | meaning |\n|---|---|---|\n" + rows + "\n";
}

std::string heading(std::string_view title, std::string_view says) {
  return "### " + std::string{title} + "\n" + std::string{says} + "\n\n";
}

template <class M>
std::string message(std::string_view direction) {
  char id[8];
  std::snprintf(id, sizeof id, "0x%02X", static_cast<unsigned>(M::kType));
  return heading(std::string{nameOf(M::kType)} + " (" + id + ")", direction) + table<M>();
}

template <class Op>
std::string operation(std::string_view says) {
  const auto number = std::to_string(static_cast<unsigned>(Op::kOperation));
  return heading(std::string{nameOf(Op::kOperation)} + " (" + number + ")", says) + "Request\n\n" +
         table<typename Op::Request>() + "Answer\n\n" + table<typename Op::Answer>();
}

template <class Enum>
std::string names(std::string_view title, unsigned first, unsigned count) {
  std::string row = "- " + std::string{title} + ":";
  for (unsigned k = first; k < first + count; ++k) {
    row += (k == first ? " " : ", ") + std::to_string(k) + " " + std::string{nameOf(static_cast<Enum>(k))};
  }
  return row + "\n";
}

std::string introduction() {
  return "# Messages of the box, protocol " + std::to_string(kProtocolMajor) + "." + std::to_string(kProtocolMinor) +
         R"(

Generated from the field lists in protocol/messages by `cmake --build build --target messages-page`; do not edit.

## Bytes
All numbers are little endian. `f64` is an IEEE 754 double; `bool` is one byte; `text` is UTF-8 with a u16 length in front, `bytes`
likewise; a `list` has a u16 count in front; `N x` is N of them without a count. A structure inside a structure has its u16 size
in front. A later minor version may add fields at the end of any structure: skip what you do not know, and keep the default of
what is not there. A field that begins must be whole.

## Rules for hosts
- A listener serves 8 hosts; the ninth gets REFUSAL (busy) and is closed. A HELLO whose major is another, or whose oldest minor is newer than the
  box's, gets REFUSAL (version_mismatch) with both versions; any other range is welcome, and WELCOME says the minor that both speak.
- Columns position_x, position_y and position_z are **counts of the encoder** times `scale`, from where it began to count: machine positions only
  where the encoder is absolute. Differences are true; places are not. TRIGGER, `corrections` and the registers have machine positions, with a
  flag for each axis whether it is referenced.
- A sample is interpolated between the stamps of its sources at the tick; the positions are those of the time tick + system delay in force,
  as the DESCRIPTOR has it, so that one row belongs together. Without a result in force they are not shifted.
- A resume with another boot id than the box's begins with the present sample, as if it had not been asked for; one from a sample that does not
  exist yet is refused; one from a sample that is not kept any more begins with the oldest that is, after a GAP.
- Sources that `enable_sources` can switch: those that machine.toml describes, by the bits of its `mask`.

## Frame
docs/decisions/0001-frame-layout.md says why. The CRC-32C of header and payload follows the payload as u32. On serial lines, TCP
and in recordings the whole is COBS-coded and ends with a zero.

CRC-32C: polynomial 1EDC6F41, bits reflected (82F63B78 shifted to the right), all ones before, inverted after; of the text 123456789 it
is E3069283. COBS: a code byte n from 1 to 255 stands before n - 1 bytes that are not 0; after them comes a 0 of the data, unless n is
255 or the coded frame ends there. 11 00 00 33 becomes 02 11 01 02 33. host-tests/system/independent holds a reader in Python that was
written from this page.

)";
}

std::string hex(std::span<const std::byte> bytes) {
  std::string text;
  for (const auto byte : bytes) {
    char digits[4];
    std::snprintf(digits, sizeof digits, "%02X", std::to_integer<unsigned>(byte));
    text += (text.empty() ? "" : " ") + std::string{digits};
  }
  return text;
}

// The example is coded here, so it cannot differ from what the box sends.
std::string fastExample() {
  const std::vector<codec::ChannelFormat> formats{{4, true}, {2, false}};
  const std::vector<std::int64_t> columns{1000, 1003, 1001, 1004, 5002, 5001, 5003, 5004, 5002, 5003,
                                          4,    4,    4,    4,    4,    4,    4,    4,    4,    4};
  std::vector<std::byte> block(codec::rawBlockSize(formats, 10));
  const auto size = codec::encodeFast({.count = 10}, formats, columns, block);
  return hex(std::span{block}.first(*size).subspan(codec::kBlockHeaderSize));
}

std::string fastProfile() {
  return R"(#### Profile fast
The channel list and the columns are as above, but order and width say how each column is coded. Arithmetic is on 64-bit integers
that wrap around; `>>` keeps the sign.

- **order**: bits 0 to 6 name the predictor, 0x80 says that exceptions follow the column. Order 0 with the width 8 x bytes of
  the channel is a column as in raw (without sign where the channel is unsigned), and nothing of what follows.
- **column** = seeds, then packed residuals, then exceptions. Predictors 0 to 3 have as many seeds as their number, predictors 4
  and 5 have 3; the column has m = count - seeds residuals.
- **seeds**: seed j is the j-th difference at sample j: x0, x1 - x0, x2 - 2 x1 + x0. Each is zigzag coded (0, -1, 1, -2, ... as 0, 1, 2,
  3, ...) and written as varint: 7 bits a byte, lowest first, 0x80 set where more bytes follow.
- **residuals**: m two's complement numbers of `width` bits (0 to 64), one after the other from the lowest bit of the first byte on,
  in ceil(m x width / 8) bytes; of width 0 all are 0 and there are no bytes.
- **exceptions**, where 0x80 is set: their number n and the bits b of a high part (u8), then n positions, then n high parts of b bits, written
  as residuals are. Number and positions are u8 when m <= 256, u16 otherwise; position 0 is the first residual. The residual there is
  high part x 2^width + its `width` bits taken as unsigned.
- **values** from residuals r:
  predictor 0: x = r. Predictor 1: x[k] = x[k-1] + r. Predictor 2: x[k] = 2 x[k-1] - x[k-2] + r.
  Predictor 3: x[k] = 3 x[k-1] - 3 x[k-2] + x[k-3] + r.
  Predictors 4 and 5 follow place p, speed v, acceleration a and jerk j in 1/16. They begin with j = 0, a = 16 (x2 - 2 x1 + x0),
  v = 16 (x2 - x1) + a, p = 16 x2 + v + 8; then for each r: x[k] = (p >> 4) + r; j += J r; a += j + A r; v += a + V r; p += v + P r.
  For the first residual (P, V, A, J) is (16, 8, 8, 0) in predictor 4 and (12, 16, 10, 3) in 5, for all others (12, 5, 1, 0) in 4 and
  (12, 7, 2, 1) in 5.

Example: channels {4 bytes, signed} and {2 bytes, unsigned}, count 10, values 1000 1003 1001 1004 5002 5001 5003 5004 5002 5003 and ten
times 4. From the channel list on the block is

)" + std::string{"    "} +
         fastExample() + R"(

81 03: predictor 1 with exceptions, 3 bits. 01 00: predictor 1, 0 bits. D0 0F: seed 2000, hence 1000. F3 7C C5 01: residuals 3, -2, 3, -2,
-1, 2, 1, -2, 1 in 27 bits. 01 0A: one exception with 10 bits of high part. 03: at position 3. F3 01: high part 499, so that
residual is 499 x 8 + 6 = 3998. 08: seed 8, hence 4, and nine residuals of no bits.

)";
}

std::string tightProfile() {
  return R"(#### Profile tight
A stream in it has two kinds of blocks, told apart by the first byte. A **key block** (2) is as above, with order 0 and the width 8 x bytes
for each channel, and needs no other. A **continued block** (3) needs the block before it in the stream. A key block comes first, at least every
16384 samples, and next after START is sent again. Until it comes, whoever has missed a block cannot read any: count their samples as lost.
A block that would be longer than in another profile is sent in that; a key block follows it.

- **continued block**: u8 3; u32 CRC-32C of the whole payload of the block before; the changes ("Short frames") of its header (`first` to
  `holdover_ms`); residuals. The changes are from the header of the block before with `first` behind its samples and `tick` later by
  count / samples_per_tick (whole ticks); of the new `at`, floor((tick - tick before) x period_q32_ns before / 2^32) is taken off first.
- **residuals**: channel by channel, all in one run of a range coder. Each value is coded by its distance r from the whole part w of what its
  channel's predictor expects, 64 bits that wrap around, and then given to the predictor; p is the rest, 0 to 1, and sd the standard deviation.
- **predictor**: protocol/codec/tight_predictor.cpp, operation by operation: double precision, rounded to nearest after every operation
  (none fused), sums from the first item on. All its members begin at 0 in a key block.
- **first 4 values** of a channel behind a key block: zigzag of r as number. A **number** is its bits (0 to 64) as one of 2^7 equal parts, then
  those below its highest 1 as equally probable bits, 16 at a time from the lowest on.
- **others**: of r the lowest s bits are equally probable bits, s = 0 for sd < 16, else floor(log2(floor(sd / 8))). Before them comes the rest,
  k = r >> s. With F the distribution in protocol/codec/tight.cpp at (k x 2^s - 0.5 - p) / sd, interpolated in steps of sd / 32 from
  -8 sd to 8 sd and rounded down, the part of k in 2^24 begins at F + k + 161 and ends where that of k + 1 begins, for k from -160 to 159.
  What is left below stands for smaller k, followed by -161 - k as number; what is left above for larger ones, followed by k - 160.
- **range coder**: low = 0, range = 2^64 - 1. A part [a, b) of 2^n: range is divided by 2^n, low rises by a x range, range is multiplied by
  b - a. Then, while the highest bytes of low and low + range agree, or range < 2^40, in which case range becomes -low mod 2^40 first: the highest
  byte of low is written, and both are multiplied by 2^8. At the end the fewest bytes are written (0 to 8) that with zeros behind them lie
  in [low, low + range).

)";
}

std::string samples() {
  return heading("SAMPLES (0x08)",
                 "Box to host. A block of columns; decoded with the channels of the DESCRIPTOR whose hash is in the "
                 "frame.") +
         "u8 profile, then\n\n" + table<codec::BlockHeader>() +
         "then u8 channels; for each channel u8 predictor order and u8 bit width; then the columns. In profile raw the "
         "order is 0, the\n"
         "width is 8 x bytes of the channel, and a column is `count` values of that width. The time of sample i is\n"
         "at + floor((i - tick x samples_per_tick) x period_q32_ns / samples_per_tick / 2^32).\n\n" +
         fastProfile() + tightProfile();
}

std::string shortFrames() {
  return heading("Short frames",
                 "On a link most HEARTBEATs and SAMPLES go short: they say how they differ from an earlier one that "
                 "stood by "
                 "itself, and name it by\n"
                 "a CRC. Whoever has not got that one leaves the short one out, as if it were lost; its frame counts. "
                 "In recordings that `probebox`\n"
                 "writes they are whole again where that one has come; SAMPLES_HEAD is there as well.") +
         R"(**Changes** of a structure of numbers: u8 n, then n bytes with a bit for each number in the order of its table, those of structures
inside in their place and without their sizes, the lowest bit of the first byte first, 1 where it has changed; then each changed number as new
minus old, modulo 2^64, zigzag coded as varint (as the seeds of profile fast). Bits beyond the numbers that you know: skip their varints.
No later version adds numbers to a structure inside.

)" +
         message<HeartbeatChange>(
             "Box to host. The changes from that HEARTBEAT follow the field. Later ones refer to one from zeros as to "
             "a HEARTBEAT.") +
         message<ShortSamples>(
             "Box to host. After the field: the changes of the block's header (`first` to `holdover_ms`), where `at` "
             "is "
             "less what the map of the whole\n"
             "one expects, floor((tick - its tick) x its period_q32_ns / 2^32); then a bit for each channel, lowest "
             "bit first, in "
             "ceil(channels / 8) bytes, 1\n"
             "where order and width have changed; u8 order and u8 width of those; then the columns. Profile, channels "
             "and descriptor "
             "are those of\nthe whole one, the latest SAMPLES or SAMPLES_HEAD: no others need to be kept.") +
         heading("SAMPLES_HEAD (0x12)",
                 "Box to host, once after a block that went whole: the payload of its SAMPLES before the columns, in a "
                 "frame with the "
                 "same descriptor hash.\nA host that lost that block can read the short ones that refer to it. Needs "
                 "no credit.");
}

std::string limits() {
  return R"(On TCP the first bytes of a connection are HELLO, after zeros at most, whole within 256 bytes and 2 s: its flags are 0, so
it begins with 03 01 01. Whatever begins otherwise is closed without a word. On a serial line garbage before HELLO is passed over.

| limit | what happens beyond it |
|---|---|
| 8 links of one TCP listener; one of a serial line or a USB port | HELLO is answered by a REFUSAL, `busy`, that names the limit |
| 32 TCP connections that have not said HELLO | the oldest is closed |
| 4096 bytes of payload of a frame to the box | the frame is passed over and counted |
| 8 requests that wait for an answer | `busy` |
| 1.5 s without a frame from the host | the link is down; on TCP it is closed |

What a host may do besides reading depends on the connection that it came in by (docs/service.md); `not_permitted` names the key.

)";
}

std::string stream() {
  return "## Handshake and stream\n\n" + limits() +
         message<Hello>("Host to box, first, after a zero that ends old garbage.") +
         message<Welcome>("Box to host. DESCRIPTOR and TEST_PATTERN follow.") +
         message<Descriptor>(
             "Box to host, and again between samples where the first block under another one follows: a delay came "
             "into "
             "force, or a resumed stream goes back to earlier blocks. The CRC-32C of its payload is the descriptor "
             "hash "
             "of the frames after it; keep the last ones and decode a block with the one whose hash is in its "
             "frame.") +
         message<TestPattern>("Box to host.") +
         message<Start>(
             "Host to box; sent again until a HEARTBEAT says streaming. The samples are stream 1; START and STOP of "
             "any other are refused and change nothing.\nWhile samples flow it may come again with nothing changed but "
             "`profile` and `credit_bytes` (which does not count then): the samples go on in that profile, none is "
             "lost.\nIn profile tight the next block is then a key block.") +
         message<Stop>("Host to box. A HEARTBEAT with streaming 0 closes the ledger.") +
         message<Credit>(
             "Host to box; also the host's sign of life, at least every 0.5 s: three missed and the link is down.") +
         samples() + message<Gap>("Box to host, in the place of the missing samples.") +
         message<Trigger>(
             "Box to host, to those whose START asked for triggers: a trigger line became active. Numbers rise by one; "
             "where they do "
             "not, a TRIGGER_GAP stands, or a frame was lost on the way. Needs no credit.") +
         message<TriggerGap>("Box to host, in the place of the missing triggers.") +
         message<Heartbeat>(
             "Box to host, 10 a second. produced = sent_samples + lost_at_source + lost_in_queue = position - start. "
             "sent_triggers + lost_triggers = next_trigger - first_trigger.") +
         shortFrames() + message<Request>("Host to box; sent again with the same id until it is answered.") +
         message<Answer>("Box to host.") + message<Refusal>("Box to host: the message was understood and refused.");
}

std::string control() {
  return "## Operations\n\n" + operation<Status>("How the box is.") +
         operation<PostMarker>("Says what the machine is doing; the box stamps it.") +
         operation<StartProcedure>("Begins a measuring procedure.") +
         operation<ProcedureStatus>("Where the procedure stands.") +
         operation<AbortProcedure>("Gives the procedure up.") + operation<ListResults>("Results, oldest first.") +
         operation<AcceptResult>(
             "Accepts a proposed result. It comes into force and the one before is retired: at once, or when the cut "
             "is over.") +
         operation<Corrections>("What the CNC is being told.") +
         operation<GetDataset>("The data of a run, for saving.") +
         operation<RollbackResult>("Goes back to the result that was in force before.") +
         operation<ResultHistory>("What happened to results, and who did it.") +
         operation<SetInhibit>("Says that a cut is on, or over; answered once the box has stored it and holds it.") +
         operation<HomeAxes>("Axes were homed: they stand still at known machine positions.") +
         operation<EnableSources>(
             "Which sources of corrections are summed. Allowed as accepting is; never while a cut is on.") +
         operation<LoopBack>(
             "Measures how late the box stamps edges, over a wire from one of its outputs to one of its inputs. "
             "Allowed as "
             "calibrating is.") +
         operation<TellPose>("How the rotary axes stand, and which tool is in the spindle. Allowed as markers are.") +
         operation<ProposeCase>("A case that was measured without the box, in pieces. Allowed as calibrating is.") +
         operation<FollowCase>(
             "What comes of a case that was proposed to be followed. One that nobody asks after for 5 s is given up, "
             "and nothing of it is stored.") +
         operation<GetResult>("One result or refusal with every value, or its dataset.") +
         operation<TellPositions>(
             "Where the axes are, as the controller knows it, for axes whose encoder is of kind \"control\". Sent "
             "again "
             "and again, one request for each reading of the controller; their time comes from its counter. Allowed as "
             "markers are.") +
         operation<Provision>(
             "Writes the identity of a box, once: a box that has one refuses, and so does one that measures or cuts. "
             "Allowed over USB, elsewhere as allow_provision says.") +
         operation<DescribeUnit>("The identity of the box.") +
         operation<OfferUpdate>(
             "A bundle of new firmware is to come. Refused while a cut or a run is on, where the box has no updater, "
             "and when the disk has no room. Allowed by allow_update, as the two after it.") +
         operation<SendUpdate>("A part of that bundle. Several may be on their way at once.") +
         operation<InstallUpdate>(
             "The bundle is complete: it is checked, installed, and started when neither a cut nor a run is on.") +
         operation<UpdateStatus>(
             "How far an update has come, and what came of the last one, also after the restart of the box.") +
         operation<ProvisionKeys>(
             "Writes the keys that the box proves itself with at tls: links, in place of those that it had. Allowed as "
             "provisioning is. Not over links that others can listen to: the key is the box's own.") +
         operation<DescribeMachine>(
             "What a run starts from: machine, probe, rates and results in force. Standard deviations are k = 1, and 0 "
             "where none is stated.");
}

// Of everything that the sections before this one have named.
std::string structures() {
  std::string all = "## Structures\n\n";
  for (const auto& [name, rows] : structureTables()) all += "### " + name + "\n\n" + rows;
  return all;
}

std::string numbers() {
  return "## Numbers\n\n" + names<ErrorCode>("error codes", 0, 11) + names<GapReason>("gap reasons", 0, 6) +
         names<Profile>("profiles", 0, 3) + names<Policy>("policies", 0, 2) + names<ClockState>("clock states", 0, 4) +
         names<RunState>("procedure states", 0, 7) + names<ResultState>("result states", 0, 5) +
         names<StepPhase>("step phases", 0, 3) + names<UpdateState>("update states", 0, 10);
}

std::string page() {
  const auto messages = introduction() + table<frame::Header>() + stream() + control();
  return messages + structures() + numbers();
}

}  // namespace
}  // namespace probebox::messages

int main(int argc, char** argv) {
  return probebox::messages::printOrCheck(argc, argv, probebox::messages::page(), "messages-page");
}
