#include <algorithm>
#include <gtest/gtest.h>
#include <map>
#include <string>
#include <string_view>

#include "samples.hpp"

// Frozen bytes of the protocol: recordings and boxes in the field have them. A failure here is a broken wire, never a
// reason to edit a line. A later minor version adds its fields behind, and lines of its own.
namespace probebox::messages {
namespace {

std::string hex(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const auto byte : bytes) {
    text += kDigits[std::to_integer<std::size_t>(byte >> 4)];
    text += kDigits[std::to_integer<std::size_t>(byte & std::byte{0x0F})];
  }
  return text;
}

std::vector<std::byte> unhex(std::string_view text) {
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<std::byte>(std::stoi(std::string{text.substr(i, 2)}, nullptr, 16)));
  return bytes;
}

// Protocol 1.0.
const std::map<std::string_view, std::string> kGolden = {
    {"HELLO", "235d8ef249035aae392df4426de018653949a943c319a47824"},
    {"WELCOME", "235d458eb8e2cd000003ae2df4426de018653949a943c319a4"},
    {"DESCRIPTOR",
     "01007008006f6f6f6f6f6f6f6f0300787878000002006d6d6de3a3b3d6a8cb55e0a703002000010078070078787878787878"
     "5362312ad161f541c301080071717171717171711b00050061616161610200747464623e0930ecf7c18e000400797979791e"
     "00030062626208007070707070707070d3aa32d6a73de141160003006f6f6f53e7c5a5b957fd4142f7b5c6a2030142ebe92e"
     "5e069ce94178cfcfaf4195f941c858730b30daf241b2beb85960f2f1c1d61d94d20545d4c1929f39493290f7c103508411e4"
     "afc5c1390000f2ad592aa19aedc13b9af23a20efe541bec2f55c1b47fec105926651ced3e841a6dc2ceb06c500c2703d37bc"
     "cfaaf8c19e087e9d4167611e"},
    {"TEST_PATTERN",
     "235d8ef24903ae2df4426de018653949a943c319a47824f241b98f8e78d01ed4b97f09db16c0861e9a9b55e8cde82d76a290"
     "1cdc436601ba9e1581eacfaf3b1d1dfca1dd4ddee03e0f3ad1dbf6e88782a11702db15a95be09e4a6add8d0df404e8f4e062"
     "36ed9714254f0ef9c45d0a0efc0778bfec967ca18edcaf5c3bfeb90026efeeb2233a535e312a88a5ec193d8c474c234e1c31"
     "dc46e544ea2a0f9d5d947ddb85e41173b2d572cd7fa4030dc160f7d51e291eca74a96d7fa64c78d1223997769d23e09e3cc5"
     "a7de2fdda6b0c5837e1e2d1d5c8b1eae8ad5041f8a1e06fb18309e8ae8e689d0887edcca314f92362d8772ae8667fcda46ea"
     "3f1951df14cc"},
    {"START", "235d8ef204a1d58a93806201035a647671a0f5b9"},
    {"STOP", "23"},
    {"CREDIT", "238d949198559cdb"},
    {"GAP", "238d949198559cdb5d4535ed7d92bc788e"},
    {"HEARTBEAT",
     "238d949198559cdb018eb8e2cdf204a1d58a93806249ff98071e9ca6ca035a647671a0f5b9ae3967651c75f8f32de2d863e5"
     "c4f6cdf412201a7171b8554247e814fd78e53a6de3a3b3d6a8cb55e0a77fde3800187ba618846295516597e6085476db4739"
     "9a298d2c3daea449482ddbe33c3628a9dcae733ffc963a4394eabcbb8ea74fc312e9160c6a179f19a442ba84781d4e454db8"
     "dca6300024453c21a35dc6aff2281c8ae0e2eb264108ed80a323f767b99e34897d554d718f0b88b2899fe1a68ead062f4a55"
     "34f8"},
    {"REQUEST", "238d94915d450300f24903"},
    {"ANSWER", "238d94915d458eb800000100ae"},
    {"REFUSAL", "238d5d08006f6f6f6f6f6f6f6f"},
    {"status answer",
     "01007008006f6f6f6f6f6f6f6f49ff98071e9ca6ca470003ae396765642d4549e7dceac1f412201a7171b85530004247e814"
     "fd78e53a6de3a3b3d6a8cb55e0a77fdeded6e0e6187ba618846295516597e6085476db47399a298d2c3daea4180049482ddb"
     "e33c3628a9dcae733ffc963a4394eabcbb8ea74fc312e916194ca7e17bdc84952000a442ba843922c8a2781d4e454db8dca6"
     "24453c21a35dc6aff2281c8ae0e2eb260200747401008ead062f4a5534f878d11000d04ebc61eb139ac01e36d1e6d7958c7e"
     "3800d4d7221aa48fd675b9f59a95b43920687f061959670c088209fea935280c78b0dbeab6d7ff121d20166db23e9185fdc3"
     "c0a0f11f25aeca8a"},
    {"post_marker request",
     "238d94915d4535ed8ea0c153ee0571fa4185f5636941a4ecc1228863de25cdf2c1ae396765642d4549e7dceac100"},
    {"start_procedure request", "010070"},
    {"start_procedure answer", "238d9491"},
    {"procedure_status answer",
     "238d949108007373737373737373f249ff9807035a64760000e35a38a6aa02f7410fa9870ea89eef412d629930d307f741c2"
     "ee5ffb67f9dac1007481b760e6f5414442be89fe49f341cdc47f816b83f8c1f5f0f246ad96e541fa2145d98474ef41030068"
     "6868194ca7e17bdc8495"},
    {"list_results request", "238d949198559cdb"},
    {"list_results answer",
     "02007f005d4535ed7d92bc788e000003006f6f6f01006d050072727272720700777777777777770100780700787878787878"
     "78010016000300767676e49adc67e805f9c1e05b68fc80edf7c100a58cdf1852e5e4414108ed80e075125f0f6afe4164623e"
     "0930ecf7c10300060077777777777704006161616108006464646464646464b00009fea935280c78b0db0800737373737373"
     "737303006f6f6f030074747401006f0800737373737373737307006f6f6f6f6f6f6f04006363636303001b00080078787878"
     "7878787805926651ced3e841a6dc2ceb06c500c20019000600666666666666be2821faf254ec413d97c0286282b4c1011800"
     "050062626262628729b8a65010e5410f3d9cc3dbaff94100555ca0221523d1c1ddff4052d09566848cbad941a96c0618aba4"
     "d9c10200000001007a01"},
    {"accept_result request", "238d949198559cdb08007373737373737373"},
    {"corrections answer",
     "0101ef46bf2221dcf6c1a0c153ee0571fa4185f5636941a4ecc1035aae392de2f412201a002d629930d307f741c2ee5ffb67"
     "f9dac1007481b760e6f5414442be89fe49f341cdc47f816b83f8c1f5f0f246ad96e541"},
    {"get_dataset request", "238d94915d4535ed7d92bc78"},
    {"get_dataset answer", "238d949198559cdb5d4535ed7d92bc7808006f6f6f6f6f6f6f6f"},
    // Since protocol 1.2.
    {"home_axes request", "230cc58d747a340042ef46bf2221dcf6c1a0c153ee0571fa41"},
    {"enable_sources request", "238d"},
    {"loop_back request", "238d9491"},
    {"loop_back answer",
     "01007008006f6f6f6f6f6f6f6f49ff9807035a6476ae3967651c75f8f32de2d863e5c4f6cdf412201a7171b8554247e814fd"
     "78e53a6de3a3b3d6a8cb55"},
};

// What protocol 1.1 has behind that.
const std::map<std::string_view, std::string_view> kSince11 = {
    {"status answer",
     "01001400040061616161040078787878e8d5c8e7cce14d5f0300190005006a6a6a6a6a76a29088195adb236d6e1c607c35d2"
     "b3dbc81c00080078787878787878786601ba8b11027e7e1ba49e087e9d4167611e1800040074747474eacfaf97b9f20aaaa1"
     "723b54ca0a69f0661045001d1d8566c1d2ee0318ff60e241a1b9237e02360af0ddff40521421c9a64dd8aaf8a033f617de8a"
     "406c1a2d1ee8e082624fe54f9d343ea4fffa2a61aa580f9c369a49da5fbd02003600040064646464f6a14bd279f7bbb3e8d0"
     "9a6ddffea9e887f9e7478315937b82dcdccfbf4a6a31a11c54d4571d054b17bc5681b217b8f33800060062626262626215c9"
     "c36ee262d0fda98f901e97dc141e5b4840a943a273c4e0285856cd3b04539e0363895bc03ac74a6faa218e66289428006adf"
     "67f72b4d965ddd0547d6e62db5c98da845cb6ed733670d24c58c77d469d3f4ce792adb60a6ed047b947a161f701801002c00"
     "0200636362598f0e064a22f536224b726f9720dbed434ffa96733cbf97697002c7ceed0c14c117125ab10a23"},
};

// What protocol 1.2 has behind that.
const std::map<std::string_view, std::string_view> kSince12 = {
    {"DESCRIPTOR",
     "ad000101eacf602ab9b06ac5fe419e2c8b97939cd1418729b8a65010e5410f3d9cc3dbaff941d2ee0318ff60e241555c"
     "a0221523d1c1e9e7de3fc3f2f7c1d09566848cbad941a96c0618aba4d9c1e060b229c40ccdf7412f95c18479e2f1c13a"
     "20c794960c2bac9d7ac1e92036fdc16f5cc0244580f341d4f21a5af178f4c15cac91d3890ed9c1c1a9ee35fd95004296"
     "7162e49287ea41fca26c6d5523f4414b1aab637d5fcac165503182ed7bf141"},
    {"list_results request", "5d4535ed8eb8e2cd"},
    {"status answer",
     "0200140004006f6f6f6f06006565656565650400636363630d0004006969696900000300676767010006006a6a6a6a6a6a18"
     "008e7ca3935cc84d4bdc8f5921bf4a1d15afaa2230db1b99ec03000300737373070063636363636363070070707070707070"
     "1300ee7f43fec04450ea002390cc7474af31e000010600787878787878"},
    {"START", "002de2d863"},
    {"propose_case request", "000008006464646464646464"},
    {"propose_case answer", "000100035a647671a0f5b9"},
    {"HEARTBEAT", "78d1e861d04ebc611e36d1e6d4d7221a"},
    {"TRIGGER", "c3f41e08c05195fcc1e49adc67e805f9c1e05b68fc80edf7c1"},
    {"start_procedure request",
     "0300a0c153ee0571fa4185f5636941a4ecc1228863de25cdf2c1cf58b96944d5c9c1642d4549e7dceac1e35a38a6aa02f741"
     "0fa9870ea89eef416de3e0a7186597399a298d01014394c3"
     "01"},
    {"procedure_status answer",
     "a4782445003ddca47072e8fb41e075125f0f6afe4164623e0930ecf7c1856c3472a9bdc0c1e90848388ad6dac12660a5c2af"
     "04f1c1c554203232fc0042002975afdc79f3fb417f09fea935d3aa32d6a73de141166dd84f4bdf7d76ffc1"
     "ea87b0eefb8dd8c1923fa4163e77e7c153e7c5a5b957fd4142f7b5c6a2030142ebe92e5e069ce941000300b2beb85960f2f1"
     "c1d61d94d20545d4c1929f39493290f7c103508411e4afc5c144665a8370a4fd41f2ad592aa19aedc1"},
    {"corrections answer",
     "01010102000300a478000300f2410101002c0000e90848388ad6dac1d01e36d1e600b91498972d3fe800c2abd86f485559f5"
     "c1d3aa32d6a73de141166db23e00ea87b0eefb8dd8c1923fa4163e77e7c153e7c5a5b957fd4142f7b5c6a203014238005596"
     "f333e8c858730b30daf241b2beb85960f2f1c1d61d94d20545d4c1929f39493290f7c103508411e4afc5c144665a8370a4fd"
     "4100dcfd43d28e1d66ae3c0301020079000001013d97c0286282b4c1cfaf97b9f23b54ca0a69f06610010f3d9cc3dbaff941"
     "d2ee0318ff60e241555ca0221523d1c1e9e7de3fc3f2f7c1d09566848cbad941a96c0618aba4d9c124a47328483fec4160b2"
     "29c40ccdf7412f95c18479e2f1c12de8a44fe180f6c19d7ac1e92036fdc16f5cc0244580f3417900000001967162e49287ea"
     "41a117bc568102c77eb15a212241017353989c0bc7a2c1740ec95e5e26e041e0f80ebb41f8efc16886625fda48f641c44284"
     "7a7a7aeec1ee43c6c8dbf2fcc1be3774f0411ff94106e7fa5edf25edc1653589af05b4fb41be2c2796efefe7c1523c8a6808"
     "b4d3c17152ed90753dda412d00e87b6598470b7c1738a157da6842edc178a060bb081be6413bd1aab5ad55c7c136224b7201"
     "76ff080ac2c3cb410002000f0004006f6f6f6ff9c4fa98d22fbef3f10f000400636363630efce142b545ecab24"},
    {"accept_result request", "0001"},
    {"home_axes request", "0300787878"},
};

// Messages that are new in protocol 1.2, and those whose inner structures have more at their ends since.
const std::map<std::string_view, std::string> kNewIn12 = {
    {"list_results answer",
     "0200d4005d4535ed7d92bc788e000003006f6f6f01006d050072727272720700777777777777770100780700787878787878"
     "7801001f000300767676e49adc67e805f9c1e05b68fc80edf7c100a58cdf1852e5e44101e075125f0f6afe418f0b88b2856c"
     "3472a9bdc0c1e90848388ad6dac1020004006161616108006464646464646464080074747474747474740800737373737373"
     "7373001e6c45bc9ab522ad02000c005596f333458cb32f010072000b002d745f0292581fed00000008006767676767676767"
     "43d28e1d010062070079797979797979e90015a28fdfe862cab78102007878050062626262620500727272727203006e6e6e"
     "04007070707007006b6b6b6b6b6b6b000002002000040064646464d4f21a5af178f4c15cac91d3890ed9c101967162e49287"
     "ea410123000700636363636363634b20a30d4c59f8417353989c0bc7a2c101e0f80ebb41f8efc100c442847a7a7aeec14a6f"
     "aa21be3774f0411ff94106e7fa5edf25edc1020004006363636307006363636363636302006363010075019769700214c117"
     "1202000d004f8973305fe7b68902006e6e000b005d70c8edb751346f0000000000bf2ed90e04006d6d6d6d06006a6a6a6a6a"
     "6a00"},
    {"accept_result answer",
     "230108006f6f6f6f6f6f6f6f01035a647671a0f5b901002e0001006d0fa9870ea89eef412d629930d307f74100007481b760"
     "e6f5414442be89fe49f34101f5f0f246ad96e54101010100010071"},
    {"rollback_result request", "238d949198559cdb080073737373737373730000"},
    {"rollback_result answer", "0100708eb8e2cd751ed7aaf204a1d58a9380620101000000"},
    {"result_history request", "238d949198559cdb08007373737373737373f204a1d58a938062"},
    {"result_history answer",
     "02003a005d4535ed7d92bc788eb8e2cd751ed7aa000003006f6f6f01006d0500727272727207007777777777777765050068"
     "6868686801006c03007676764d00a442ba843922c8a2781d4e454db8dca60500616161616102007474060071717171717106"
     "00777777777777040061616161b9080070707070707070700500757575757508006b6b6b6b6b6b6b6b00"},
    {"set_inhibit request", "01080073737373737373730000"},
    {"TRIGGER",
     "238d94915d8eb8e2cdf204a1d58a93806249ff98071e9ca6ca035a6476ae3967652df40fa9870ea89eef412d629930d307f7"
     "41c2ee5ffb67f9dac1007481b760e6f5414442be89fe49f341cdc47f816b83f8c101014394"},
    {"TRIGGER_GAP", "238d94915d4535ed8e"},
    {"abort_procedure request", "238d9491"},
    {"tell_positions request",
     "235d4535ed8ef204a1d58a93806249ff98071e9ca6ca035a647671a0f5b9ae3967651c75f8f32de2d863e5c4f6cdf412201a"
     "7171b855"},
    {"tell_pose request", "230cc58d747a340042ef46bf2221dcf6c1a0c153ee0571fa4101035a6476cf58b96944d5c9c1"},
    {"propose_case request",
     "238d949101000000010026000000f403002d629930d307f741c2ee5ffb67f9dac1007481b760e6f541659705006868686868"
     "02001a0003006868680100710200d56f477a0789f5c1a58cdf1852e5e441160002007474060071717171717101002660a5c2"
     "af04f1c1"},
    {"propose_case answer", "238d949198559cdb08007373737373737373"},
    {"follow_case request", "238d949101"},
    {"get_result request", "238d949198559cdb5d8eb8e2cd751ed7aa"},
    {"get_result answer",
     "0201238d949198559cdb5d08006f6f6f6f6f6f6f6f0300787878000002006d6d07006b6b6b6b6b6b6b050066666666660500"
     "686868686802001f000300686868f41e08c05195fcc1e49adc67e805f9c100d56f477a0789f5c1001e000200747464623e09"
     "30ecf7c1856c3472a9bdc0c1002660a5c2af04f1c1006fdf264bc6a1ff41b9f59a951498972d3fe800c2abd86f485559f5c1"
     "03000800737373737373737303006f6f6f030074747401006f0800737373737373737301767edc7fa24904f4020013001c60"
     "7c35d2b3dbc80800787878787878787800120001f75277c5740e83070079797979797979010300616161cf96065f05006262"
     "6262620500727272727200a1b9237e02360af0ddff40521421c9a60600616161616161"},
    {"provision request", "010070"},
    {"provision answer", "010070"},
    {"describe_unit answer",
     "010108006f6f6f6f6f6f6f6f0300787878000002006d6d6de3e0a703003500010078f5f0f246ad96e541fa2145d98474ef41"
     "5362312ad161f541030076767608007171717171717171050061616161610200747440000600717171717171e90848388ad6"
     "dac12660a5c2af04f1c1c554203232fc00420300626262080070707070707070700500757575757508006b6b6b6b6b6b6b6b"
     "410004006161616142f7b5c6a2030142ebe92e5e069ce94178cfcfaf4195f9410800737373737373737307006f6f6f6f6f6f"
     "6f0400636363630800676767676767676702000100620700797979797979790200030061616102007878"},
    {"offer_update request",
     "01007008006f6f6f6f6f6f6f6f49ff98071e9ca6ca03ae2df4426de018653949a943c319a47824f241b98f8e78d01ed4b97f"
     "09db16"},
    {"offer_update answer", "238d94915d4535ed7d92bc78"},
    {"send_update request", "238d94915d4535ed7d92bc780300f24903"},
    {"send_update answer", "238d949198559cdb5d4535ed7d92bc78"},
    {"install_update request", "238d949101"},
    {"install_update answer", "238d949198559cdb"},
    {"update_status answer",
     "235d4535ed7d92bc7808006f6f6f6f6f6f6f6f0300787878ae3967651c75f8f32de2d863e5c4f6cdf4050072727272720700"
     "77777777777777010078"},
    {"follow_case answer", "235d4535ed8eb8e2cd751ed7aa00000100ae3967651c75f8f3"},
};

TEST(Golden, EveryMessageIsTheseBytes) {
  std::size_t seen = 0;
  forEachMessage([&](const char* name, auto message) {
    Filler{2026}.fill(message);
    const auto& golden_bytes = kNewIn12.contains(name) ? kNewIn12 : kGolden;
    ASSERT_TRUE(golden_bytes.contains(name)) << name;
    auto golden = golden_bytes.at(name);
    for (const auto* since : {&kSince11, &kSince12}) {
      if (const auto more = since->find(name); more != since->end()) golden += more->second;
    }
    EXPECT_EQ(hex(encoded(message)), golden) << "{\"" << name << "\",\n \"" << hex(encoded(message)) << "\"},";
    ++seen;
  });
  const auto is_new = [](const auto& line) { return !kGolden.contains(line.first); };
  EXPECT_EQ(seen, kGolden.size() + static_cast<std::size_t>(std::ranges::count_if(kNewIn12, is_new)));
}

// What a box of protocol 1.0 lists is still understood, without what it does not know.
TEST(Golden, ResultsOfAnOlderBoxAreRead) {
  const auto bytes = unhex(kGolden.at("list_results answer"));
  const auto list = decode<ListResults::Answer>(bytes);
  ASSERT_TRUE(list.ok());
  ASSERT_EQ(list->results.size(), 2U);
  EXPECT_TRUE(list->more);
  for (const auto& result : list->results) {
    EXPECT_FALSE(result.values.empty());
    EXPECT_EQ(result.subject, "");
    EXPECT_EQ(result.retired_utc, "");
    EXPECT_FALSE(result.waiting_for_cut);
  }
  EXPECT_EQ(list->results[1].method, "ssssssss");
  EXPECT_EQ(decode<AcceptResult::Answer>({})->state, ResultState::active) << "it activated at once";
}

// A host of protocol 1.0 asks for no triggers, and a box of 1.0 counts none.
TEST(Golden, TriggersAreNothingThatAnOlderSideAsksForOrCounts) {
  const auto start = decode<Start>(unhex(kGolden.at("START")));
  ASSERT_TRUE(start.ok());
  EXPECT_FALSE(start->triggers);
  const auto beat = decode<Heartbeat>(unhex(kGolden.at("HEARTBEAT")));
  ASSERT_TRUE(beat.ok());
  EXPECT_EQ(beat->first_trigger, 0U);
  EXPECT_EQ(beat->sent_triggers + beat->lost_triggers, 0U);
}

TEST(Golden, HelloOfEveryVersionIsTheseBytes) {
  auto hello = Hello::current();
  EXPECT_EQ(hex(encoded(hello)), "50425831010000020000000000000000000000000000000000");
  hello.max_minor = 1;
  EXPECT_EQ(hex(encoded(hello)), "50425831010000010000000000000000000000000000000000");
  hello.max_minor = 0;
  EXPECT_EQ(hex(encoded(hello)), "50425831010000000000000000000000000000000000000000");
}

}  // namespace
}  // namespace probebox::messages
