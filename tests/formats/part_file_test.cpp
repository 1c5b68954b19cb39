#include "formats/part_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/error.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

namespace fs = std::filesystem;

void write(PartFile& part, std::string_view text) {
  part.file().append(std::as_bytes(std::span(text.data(), text.size())));
}

TEST(PartFile, TwoWritersOfOneNameNeverShareBytes) {
  const test::TemporaryFolder folder;
  PartFile first(folder / "y.ply", true);
  PartFile second(folder / "y.ply", true);
  write(first, "first");
  write(second, "second");
  second.publish();
  EXPECT_EQ(test::read_text(folder / "y.ply"), "second");
  first.publish();
  EXPECT_EQ(test::read_text(folder / "y.ply"), "first");
}

TEST(PartFile, AFileThatHasThePartsNameIsNotTouched) {
  const test::TemporaryFolder folder;
  folder.write("y.ply.part", std::string_view("the user's"));
  folder.write("y.ply.1.part", std::string_view("a killed run's"));
  { PartFile part(folder / "y.ply", false); }
  EXPECT_EQ(test::read_text(folder / "y.ply.part"), "the user's");
  EXPECT_EQ(test::read_text(folder / "y.ply.1.part"), "a killed run's");
}

TEST(PartFile, WhatAppearsMeanwhileIsReplacedOnlyIfToldSo) {
  const test::TemporaryFolder folder;
  for (const bool replace : {false, true}) {
    PartFile part(folder / "y.ply", replace);
    write(part, "new");
    folder.write("y.ply", std::string_view("another's"));
    if (replace) {
      part.publish();
    } else {
      try {
        part.publish();
        ADD_FAILURE() << "no error";
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
      }
    }
    EXPECT_EQ(test::read_text(folder / "y.ply"), replace ? "new" : "another's");
  }
}

TEST(PartFile, ALinksTargetIsReplacedAndTheLinkStays) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "elsewhere/real.ply", "old");
  fs::create_symlink(folder / "elsewhere/real.ply", folder / "y.ply");
  PartFile part(folder / "y.ply", true);
  write(part, "new");
  part.publish();
  EXPECT_TRUE(fs::is_symlink(folder / "y.ply"));
  EXPECT_EQ(test::read_text(folder / "elsewhere/real.ply"), "new");
}

}  // namespace
}  // namespace cairn::formats
