// Normals and radii estimated by the real program, and what the dataset tells of them.
#include <cstring>

#include "tests/end_to_end/program_test.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

using ::testing::HasSubstr;

class Estimates : public ProgramTest {
 protected:
  /// A flat ascii PLY of 20 x 20 points, whose normals, if it has them, point down.
  std::string flat_ply(bool normals) {
    std::string text =
        "ply\nformat ascii 1.0\nelement vertex 400\nproperty float x\nproperty float y\n"
        "property float z\n";
    if (normals) text += "property float nx\nproperty float ny\nproperty float nz\n";
    text += "end_header\n";
    for (int i = 0; i < 400; ++i)
      text += std::to_string(i / 20) + " " + std::to_string(i % 20) +
              (normals ? " 5 0 0 -1\n" : " 5\n");
    const std::string path = folder_ / "flat.ply";
    write_text(path, text);
    return path;
  }

  Outcome verify(const std::string& scan) {
    return cairn({"verify", "--progress", "none", output(), "--against", scan});
  }
};

TEST_F(Estimates, AreToldAndLeaveTheInputsDigestAsItWas) {
  const std::string scan = write_wavy_las(folder_ / "wavy.las", 5000);
  for (const char* preset : {"default", "archive"}) {
    const Outcome built = build({scan, "--preset", preset, "--estimate", "normals", "--estimate",
                                 "radii", "--node-points", "500", "--force"});
    ASSERT_EQ(built.exit_code, 0) << built.err;
    EXPECT_THAT(built.out, HasSubstr("normal float32 x 3 (estimated)"));
    const Outcome verified = verify(scan);
    EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
    const auto told = info();
    EXPECT_EQ(told.at("schema").back().at("name"), "normal");
    EXPECT_EQ(told.at("schema").back().at("estimated"), true);
    EXPECT_EQ(told.at("schema").front().at("estimated"), false);
    EXPECT_EQ(told.at("radius"), "estimated from neighbors");
    EXPECT_EQ(told.at("parameters").at("estimate"), nlohmann::json({"normals", "radii"}));
    EXPECT_EQ(told.at("parameters").at("neighbors"), 16);
  }
}

TEST_F(Estimates, LosslessLeavesAreDigestedWithoutThem) {
  const std::string scan = write_wavy_las(folder_ / "wavy.las", 3000);
  ASSERT_EQ(build({scan, "--preset", "archive", "--estimate", "normals"}).exit_code, 0);
  const Outcome verified = cairn({"verify", "--progress", "none", output()});
  EXPECT_EQ(verified.exit_code, 0) << verified.out;
  EXPECT_THAT(verified.out, ::testing::Not(HasSubstr("digests of")));
}

TEST_F(Estimates, DoNotDependOnThreadsOrMemory) {
  const std::string scan = write_wavy_las(folder_ / "wavy.las", 20000);
  const auto bytes = [&](const std::string& threads, const std::string& memory) {
    const Outcome built =
        build({scan, "--estimate", "normals", "--estimate", "radii", "--node-points", "1000",
               "--threads", threads, "--memory", memory, "--force"});
    EXPECT_EQ(built.exit_code, 0) << built.err;
    return read_text(output() + "/index.bin") + read_text(output() + "/nodes.bin") +
           read_text(output() + "/metadata.json");
  };
  const std::string one = bytes("1", "1GiB");
  EXPECT_TRUE(bytes("2", "1GiB") == one);
  EXPECT_TRUE(bytes("7", "64MiB") == one);
}

TEST_F(Estimates, ReplaceTheInputsNormalsOnlyIfThoseAreDropped) {
  const std::string scan = flat_ply(true);
  const Outcome refused = build({scan, "--estimate", "normals"});
  expect_refusal(refused, 2);
  EXPECT_THAT(refused.err, HasSubstr("--drop normal"));
  ASSERT_EQ(build({scan, "--estimate", "normals", "--drop", "normal"}).exit_code, 0);
  EXPECT_EQ(info().at("schema").at(0).at("estimated"), true);
  EXPECT_EQ(verify(scan).exit_code, 0);
}

TEST_F(Estimates, FaceTheSensorThatThePosesTell) {
  const std::string scan = flat_ply(false);
  write_text(folder_ / "poses.tsv", "scan tx ty tz qw qx qy qz\nflat.ply 10 10 -30 1 0 0 0\n");
  const Outcome built = build({scan, "--estimate", "normals", "--estimate", "radii", "--poses",
                               folder_ / "poses.tsv", "--poses-tell", "sensors"});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  const std::string back = folder_ / "back.ply";
  ASSERT_EQ(cairn({"export", "--progress", "none", output(), "-o", back}).exit_code, 0);
  const std::string bytes = read_text(back);
  const std::size_t start = bytes.find("end_header\n") + 11;
  EXPECT_THAT(bytes.substr(0, start), HasSubstr("property float radius"));
  ASSERT_EQ(bytes.size(), start + 400 * (24 + 12 + 4));
  for (std::size_t i = 0; i < 400; ++i) {
    std::array<float, 3> normal;
    std::memcpy(normal.data(), &bytes[start + 40 * i + 24], 12);
    ASSERT_EQ(normal, (std::array<float, 3>{0, 0, -1}));
  }
}

TEST_F(Estimates, NotAskedForLeaveNoTrace) {
  const std::string scan = flat_ply(false);
  const auto bytes = [&](std::vector<std::string> flags) {
    flags.insert(flags.begin(), {scan, "--force"});
    EXPECT_EQ(build(flags).exit_code, 0);
    return read_text(output() + "/index.bin") + read_text(output() + "/metadata.json");
  };
  EXPECT_TRUE(bytes({}) == bytes({"--neighbors", "30"}));
  EXPECT_EQ(info().at("version"), 1);
  EXPECT_EQ(info().at("radius"), "estimated");
}

TEST_F(Estimates, OfUnknownThingsAreRefused) {
  const std::string scan = flat_ply(false);
  expect_refusal(build({scan, "--estimate", "colors"}), 2);
  expect_refusal(build({scan, "--estimate", "normals", "--neighbors", "2"}), 2);
}

}  // namespace
}  // namespace cairn::test
