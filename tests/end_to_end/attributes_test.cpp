// The round trip that the README's table promises, cell by cell: scans that bring all that their formats can, through a
// lossless build and each format of export, read back by the project's readers and by parsers that share no code with them.
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "formats/scalar_value.h"
#include "formats/scans/scan_reader.h"
#include "tests/end_to_end/program_test.h"
#include "tests/support/e57_bytes.h"
#include "tests/support/las_bytes.h"
#include "tests/support/las_points.h"
#include "tests/support/scan_points.h"

namespace cairn::test {
namespace {

constexpr std::size_t kPoints = 300;

/// Values by the names that PLY and texts have for them, "x", "red", "nx", "gps_time"; points in ascending x.
using Columns = std::map<std::string, std::vector<double>>;

/// A scan and what it holds, told apart from any reader.
struct Made {
  std::string path;
  Columns columns;
};

/// A number for a point and a column, from 0 to 2^bits - 1, that looks like any.
std::uint64_t hash(std::size_t point, std::uint64_t column, unsigned bits) {
  std::uint64_t h = (point + 1) * 0x9E3779B97F4A7C15U ^ (column + 1) * 0xC2B2AE3D27D4EB4FU;
  h = (h ^ h >> 29) * 0xBF58476D1CE4E5B9U;
  return (h ^ h >> 32) & ((std::uint64_t{1} << bits) - 1);
}

void append(Columns& columns, const std::string& name, double value) {
  columns[name].push_back(value);
}

/// LAS 1.4, point format 10: every field that LAS has, and extra bytes with a scale.
Made make_las(const TemporaryFolder& folder) {
  std::string entry =
      extra_bytes_entry("Reflectance", 4, 1 | 8 | 16);  // int16; no-data, scale, offset
  put_at<std::int64_t>(entry, 40, -32768);
  put_at<double>(entry, 112, 0.01);
  put_at<double>(entry, 136, -5);
  entry.replace(160, 8, "in dB, r");
  std::string normals;
  for (const char* name : {"NormalX", "NormalY", "NormalZ"}) normals += extra_bytes_entry(name, 9);
  LasBytes las{
      .minor = 4, .point_format = 10, .scale = {0.01, 0.001, 0.01}, .offset = {500000, 0, 10}};
  const std::string wkt = "PROJCS[\"site\",UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"2994\"]]";
  las.vlrs = {vlr_bytes("LASF_Spec", 4, entry + normals + extra_bytes_entry("id", 7)),
              vlr_bytes("LASF_Projection", 2112, wkt + '\0')};
  Columns columns;
  for (std::size_t i = 0; i < kPoints; ++i) {
    std::string r;
    const auto whole = [&]<typename T>(const char* name, T, unsigned bits) {
      const auto value = static_cast<T>(hash(i, std::hash<std::string>{}(name), bits));
      put(r, value);
      append(columns, name, static_cast<double>(value));
    };
    const std::int32_t steps[3] = {static_cast<std::int32_t>(i) * 37,
                                   static_cast<std::int32_t>(hash(i, 1, 20)),
                                   static_cast<std::int32_t>(hash(i, 2, 12)) - 2000};
    for (const std::int32_t step : steps) put(r, step);
    append(columns, "x", 500000 + 0.01 * steps[0]);
    append(columns, "y", 0.001 * steps[1]);
    append(columns, "z", 10 + 0.01 * steps[2]);
    whole("intensity", std::uint16_t{}, 16);
    const auto returns = hash(i, 3, 8), flags = hash(i, 4, 8);
    put(r, static_cast<std::uint8_t>(returns));
    put(r, static_cast<std::uint8_t>(flags));
    append(columns, "return_number", static_cast<double>(returns & 15));
    append(columns, "return_count", static_cast<double>(returns >> 4));
    append(columns, "class_flags", static_cast<double>(flags & 15));
    // Direction, edge of flight line, then the channel.
    append(columns, "scan_flags", static_cast<double>(flags >> 6 | (flags >> 4 & 3) << 2));
    whole("classification", std::uint8_t{}, 8);
    whole("user_data", std::uint8_t{}, 8);
    whole("scan_angle", std::int16_t{}, 16);
    whole("point_source_id", std::uint16_t{}, 16);
    const double time = 1e8 + static_cast<double>(hash(i, 5, 40)) * 1e-6;
    put(r, time);
    append(columns, "gps_time", time);
    for (const char* name : {"red", "green", "blue", "near_infrared"})
      whole(name, std::uint16_t{}, 16);
    for (std::size_t b = 0; b < 29; ++b)
      whole(("waveform_" + std::to_string(b)).c_str(), std::uint8_t{}, 8);
    whole("reflectance", std::int16_t{}, 16);
    for (const char* name : {"nx", "ny", "nz"}) {
      const float part = "xyz"[hash(i, 6, 8) % 3] == name[1] ? -1 : 0;
      put(r, part);
      append(columns, name, part);
    }
    whole("id", std::uint64_t{}, 53);
    las.records.push_back(std::move(r));
  }
  return {folder.write("all.las", las.build()), columns};
}

/// A text of rows with these columns, whose values are written so that they read back the same.
std::string rows_of(const Columns& columns, const std::vector<std::string>& names, char separator) {
  std::string text;
  for (std::size_t i = 0; i < kPoints; ++i)
    for (const std::string& name : names) {
      char number[32];
      std::snprintf(number, sizeof number, "%.17g", columns.at(name)[i]);
      text += number;
      text += name == names.back() ? '\n' : separator;
    }
  return text;
}

struct Field {
  const char* name;
  const char* type;  ///< as PLY has it
};

/// Columns of these fields. Positions are multiples of an eighth, which binary grids hold.
Columns columns_of(const std::vector<Field>& fields) {
  Columns columns;
  for (std::size_t i = 0; i < kPoints; ++i) {
    append(columns, "x", static_cast<double>(i) / 4);
    append(columns, "y", static_cast<double>(hash(i, 1, 10)) / 8);
    append(columns, "z", static_cast<double>(hash(i, 2, 8)) / 8);
    for (const Field& field : fields) {
      const std::string name = field.name, type = field.type;
      const std::uint64_t seed =
          hash(name.size(), static_cast<std::uint64_t>(name[0]) * 256 + name.back(), 40);
      const unsigned bits = type == "uchar" ? 8 : type == "int" ? 30 : 16;
      double value = static_cast<double>(hash(i, seed, bits));
      if (type == "int") value -= 1 << 29;
      // Eighths have few digits, in float32 and as decimals.
      if (type == "float") value /= 8;
      if (type == "double") value = value / 977 + 1e8;
      if (name[0] == 'n' && name.size() == 2) value = "xyz"[hash(i, 6, 8) % 3] == name[1] ? 1 : 0;
      append(columns, name, value);
    }
  }
  return columns;
}

Made make_ply(const TemporaryFolder& folder) {
  const std::vector<Field> fields{{"nx", "float"},        {"ny", "float"},
                                  {"nz", "float"},        {"red", "uchar"},
                                  {"green", "uchar"},     {"blue", "uchar"},
                                  {"radius", "float"},    {"intensity", "float"},
                                  {"gps_time", "double"}, {"classification", "uchar"},
                                  {"quality", "int"}};
  const Columns columns = columns_of(fields);
  std::string header = "ply\nformat ascii 1.0\ncomment crs EPSG:2994\nelement vertex " +
                       std::to_string(kPoints) +
                       "\nproperty double x\nproperty double y\nproperty double z\n";
  std::vector<std::string> names{"x", "y", "z"};
  for (const Field& field : fields) {
    header += std::string("property ") + field.type + " " + field.name + "\n";
    names.emplace_back(field.name);
  }
  return {folder.write("all.ply", header + "end_header\n" + rows_of(columns, names, ' ')), columns};
}

Made make_pcd(const TemporaryFolder& folder) {
  const std::vector<Field> fields{
      {"intensity", "float"}, {"nx", "float"}, {"ny", "float"}, {"nz", "float"}, {"label", "int"}};
  const Columns columns = columns_of(fields);
  const std::string header =
      "VERSION .7\nFIELDS x y z intensity normal_x normal_y normal_z label\nSIZE 8 8 8 4 4 4 4 4\n"
      "TYPE F F F F F F F I\nCOUNT 1 1 1 1 1 1 1 1\nWIDTH " +
      std::to_string(kPoints) + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
      std::to_string(kPoints) + "\nDATA ascii\n";
  return {
      folder.write(
          "all.pcd",
          header + rows_of(columns, {"x", "y", "z", "intensity", "nx", "ny", "nz", "label"}, ' ')),
      columns};
}

Made make_ptx(const TemporaryFolder& folder) {
  const Columns columns =
      columns_of({{"intensity", "float"}, {"red", "uchar"}, {"green", "uchar"}, {"blue", "uchar"}});
  const std::string header =
      std::to_string(kPoints) +
      "\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  // The first cell stands at 0 0 0 if its hashes are 0, which would be an empty one.
  EXPECT_NE(columns.at("y")[0], 0);
  return {folder.write(
              "all.ptx",
              header + rows_of(columns, {"x", "y", "z", "intensity", "red", "green", "blue"}, ' ')),
          columns};
}

Made make_csv(const TemporaryFolder& folder) {
  const std::vector<Field> fields{{"red", "ushort"},      {"green", "ushort"},
                                  {"blue", "ushort"},     {"intensity", "ushort"},
                                  {"gps_time", "double"}, {"classification", "uchar"},
                                  {"quality", "int"}};
  const Columns columns = columns_of(fields);
  std::vector<std::string> names{"x", "y", "z"};
  std::string header = "x,y,z";
  for (const Field& field : fields) {
    names.emplace_back(field.name);
    header += std::string(",") + field.name;
  }
  return {folder.write("all.csv", header + "\n" + rows_of(columns, names, ',')), columns};
}

/// Whole numbers of a column, shifted; what an E57 file stores.
std::vector<std::int64_t> wholes(const Columns& columns, const std::string& name, double factor = 1,
                                 std::int64_t shift = 0) {
  std::vector<std::int64_t> values;
  for (const double value : columns.at(name))
    values.push_back(std::llround(value * factor) + shift);
  return values;
}

constexpr const char* kE57Wkt = "PROJCS[\"site\",UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"2994\"]]";

Made write_e57(const TemporaryFolder& folder, const std::string& name, E57ScanBytes scan,
               const Columns& columns) {
  const E57Bytes file{.scans = {std::move(scan)},
                      .root_xml = std::string("<coordinateMetadata type=\"String\"><![CDATA[") +
                                  kE57Wkt + "]]></coordinateMetadata>"};
  return {folder.write(name, file.bytes()), columns};
}

/// All that the standard and its extension of normals have for a point, under a pose that turns about (1, 1, 1): x becomes
/// y, y becomes z, z becomes x.
Made make_e57(const TemporaryFolder& folder) {
  Columns columns = columns_of({{"nx", "float"},
                                {"ny", "float"},
                                {"nz", "float"},
                                {"red", "ushort"},
                                {"green", "ushort"},
                                {"blue", "ushort"},
                                {"intensity", "ushort"},
                                {"gps_time", "double"},
                                {"row_index", "ushort"},
                                {"column_index", "ushort"}});
  for (std::size_t i = 0; i < kPoints; ++i) {
    const auto count = 1 + hash(i, 7, 2);
    append(columns, "return_count", static_cast<double>(count));
    append(columns, "return_number", static_cast<double>(1 + hash(i, 8, 8) % count));
  }
  E57ScanBytes scan{
      .streams = {},
      .xml =
          "<pose type=\"Structure\"><rotation type=\"Structure\"><w type=\"Float\">0.5</w>"
          "<x type=\"Float\">0.5</x><y type=\"Float\">0.5</y><z type=\"Float\">0.5</z></rotation>"
          "<translation type=\"Structure\"><x type=\"Float\">-16</x><y type=\"Float\">2.5</y>"
          "<z type=\"Float\">0</z></translation></pose>"};
  const std::string eighths = R"(scale="0.125")";
  scan.streams.push_back(
      e57_scaled("cartesianX", -20, 4095, eighths, wholes(columns, "y", 8, -20)));
  scan.streams.push_back(e57_scaled("cartesianY", 0, 4095, eighths, wholes(columns, "z", 8)));
  scan.streams.push_back(e57_scaled("cartesianZ", 0, 4095, eighths, wholes(columns, "x", 8, 128)));
  const auto add_floats = [&](const char* name, const char* column) {
    std::vector<float> values;
    for (const double value : columns.at(column)) values.push_back(static_cast<float>(value));
    scan.streams.push_back(e57_floats(name, values));
  };
  add_floats("nor:normalX", "ny");
  add_floats("nor:normalY", "nz");
  add_floats("nor:normalZ", "nx");
  for (const auto& [field, column] :
       {std::pair{"colorRed", "red"}, std::pair{"colorGreen", "green"},
        std::pair{"colorBlue", "blue"}, std::pair{"intensity", "intensity"},
        std::pair{"rowIndex", "row_index"}, std::pair{"columnIndex", "column_index"}})
    scan.streams.push_back(e57_integers(field, 0, 65535, wholes(columns, column)));
  scan.streams.push_back(e57_doubles("timeStamp", columns.at("gps_time")));
  scan.streams.push_back(
      e57_integers("returnIndex", 0, 7, wholes(columns, "return_number", 1, -1)));
  scan.streams.push_back(e57_integers("returnCount", 0, 7, wholes(columns, "return_count")));
  return write_e57(folder, "all.e57", std::move(scan), columns);
}

/// Positions on decimal steps, which stay, colors of 8 bits, and a field of an extension.
Made make_e57_steps(const TemporaryFolder& folder) {
  Columns columns =
      columns_of({{"red", "uchar"}, {"green", "uchar"}, {"blue", "uchar"}, {"quality", "int"}});
  for (const char* axis : {"x", "y", "z"})
    for (double& value : columns[axis]) value *= 0.08;  // of eighths: hundredths
  E57ScanBytes scan;
  const std::string hundredths = R"(scale="0.01")";
  for (const auto& [field, column] :
       {std::pair{"cartesianX", "x"}, std::pair{"cartesianY", "y"}, std::pair{"cartesianZ", "z"}})
    scan.streams.push_back(e57_scaled(field, 0, 1 << 16, hundredths, wholes(columns, column, 100)));
  for (const auto& [field, column] :
       {std::pair{"colorRed", "red"}, std::pair{"colorGreen", "green"},
        std::pair{"colorBlue", "blue"}})
    scan.streams.push_back(e57_integers(field, 0, 255, wholes(columns, column)));
  scan.streams.push_back(
      e57_integers("acme:quality", INT32_MIN, INT32_MAX, wholes(columns, "quality")));
  return write_e57(folder, "steps.e57", std::move(scan), columns);
}

std::vector<std::string> names_of(const formats::Attribute& attribute) {
  if (attribute.name == "color") return {"red", "green", "blue"};
  if (attribute.name == "normal") return {"nx", "ny", "nz"};
  if (attribute.components == 1) return {attribute.name};
  std::vector<std::string> names;
  for (int i = 0; i < attribute.components; ++i)
    names.push_back(attribute.name + "_" + std::to_string(i));
  return names;
}

/// What the project's reader finds in a file, in ascending x.
Columns read_back(const std::string& path) {
  const ScanPoints scan = read_points(path);
  std::vector<std::size_t> order(scan.points.count);
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](std::size_t i) { return scan.world(i)[0]; });
  Columns columns;
  for (const std::size_t i : order) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      append(columns, std::string(1, "xyz"[axis]), scan.world(i)[axis]);
    for (std::size_t a = 0; a < scan.info.schema.size(); ++a) {
      const formats::Attribute& attribute = scan.info.schema[a];
      const auto names = names_of(attribute);
      for (std::size_t c = 0; c < names.size(); ++c)
        append(columns, names[c],
               formats::load_scalar(scan.points.columns[a].data() + i * attribute.size_bytes() +
                                        c * formats::size_bytes(attribute.type),
                                    attribute.type));
    }
  }
  return columns;
}

const std::set<std::string> kLasFields{"intensity",       "return_number",  "return_count",
                                       "scan_flags",      "classification", "class_flags",
                                       "user_data",       "scan_angle",     "scan_angle_rank",
                                       "point_source_id", "gps_time"};

/// What an input brings, and what its exports must not lack.
struct Input {
  const char* name;
  Made (*make)(const TemporaryFolder&);
  bool color8;  ///< colors of 8 bits, which LAS holds times 257
  const char* crs;
};

void PrintTo(const Input& input, std::ostream* out) { *out << input.name; }

class AttributeTable : public ProgramTest, public testing::WithParamInterface<Input> {
 protected:
  std::string exported(const std::string& suffix) {
    const std::string path = folder_ / ("back" + suffix);
    const Outcome outcome = cairn({"export", "--progress", "none", output(), "-o", path});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return path;
  }

  static void expect_equal(const Columns& expected, const Columns& found, double color_factor) {
    for (const auto& [name, values] : expected) {
      ASSERT_TRUE(found.contains(name)) << name;
      ASSERT_EQ(found.at(name).size(), kPoints);
      const bool color = name == "red" || name == "green" || name == "blue";
      const bool axis = name == "x" || name == "y" || name == "z";
      for (std::size_t i = 0; i < kPoints; ++i) {
        const double want = values[i] * (color ? color_factor : 1), got = found.at(name)[i];
        if (axis)
          ASSERT_NEAR(got, want, 1e-9) << name << " of point " << i;
        else
          ASSERT_EQ(got, want) << name << " of point " << i;
      }
    }
  }

  /// LAS has fields that a scan need not bring: they are 0, and every point is the only return of its pulse. An intensity
  /// that is no whole number stands in extra bytes, behind the field.
  static void expect_equal_in_las(Columns expected, Columns found, double color_factor) {
    if (found.contains("intensity_2")) std::swap(expected["intensity_2"], expected["intensity"]);
    if (found.contains("intensity_2")) expected.erase("intensity");
    for (const auto& [name, values] : found) {
      if (expected.contains(name)) continue;
      const double usual = name.starts_with("return_") ? 1 : 0;
      const bool field = kLasFields.contains(name);
      EXPECT_TRUE(field && std::ranges::count(values, usual) == kPoints) << name;
    }
    expect_equal(expected, found, color_factor);
  }

  /// The independent parser of tests/support/compare_scans.py, which is told what must be there.
  void expect_python_agrees(const Columns& expected, const std::string& path) {
    std::vector<std::string> names;
    for (const auto& [name, values] : expected) names.push_back(name);
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ",") + name;
    const std::string scan =
        folder_.write("expected.csv", text + "\n" + rows_of(expected, names, ','));
    const nlohmann::json grid = info().at("grid");
    std::vector<std::string> arguments{CAIRN_SOURCE "/tests/support/compare_scans.py", scan, path};
    for (const char* key : {"step", "offset"})
      for (const nlohmann::json& number : grid.at(key)) arguments.push_back(number.dump());
    const Outcome compared = run_program("/usr/bin/python3", arguments);
    EXPECT_EQ(compared.exit_code, 0) << compared.err;
    EXPECT_EQ(compared.out, std::to_string(kPoints) + "\n");
  }
};

TEST_P(AttributeTable, EverythingComesBack) {
  const Made made = GetParam().make(folder_);
  const Outcome built = build({made.path, "--lossless-leaves", "--node-points", "60"});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  const Outcome verified =
      cairn({"verify", "--progress", "none", output(), "--against", made.path});
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  {
    SCOPED_TRACE("las");
    expect_equal_in_las(made.columns, read_back(exported(".las")), GetParam().color8 ? 257 : 1);
  }
  for (const char* suffix : {".ply", ".xyz", ".csv"}) {
    SCOPED_TRACE(suffix);
    const std::string path = exported(suffix);
    const Columns back = read_back(path);
    EXPECT_EQ(back.size(), made.columns.size());
    expect_equal(made.columns, back, 1);
    expect_python_agrees(made.columns, path);
    const std::string crs = suffix == std::string(".csv") ? "" : GetParam().crs;
    EXPECT_EQ(crs.empty(), read_points(path).info.crs.empty());
    EXPECT_EQ(read_text(path).find("crs " + crs) != std::string::npos, !crs.empty());
  }
}

INSTANTIATE_TEST_SUITE_P(
    Formats, AttributeTable,
    testing::Values(Input{"las", make_las, false,
                          "PROJCS[\"site\",UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"2994\"]]"},
                    Input{"e57", make_e57, false, kE57Wkt},
                    Input{"e57_steps", make_e57_steps, true, kE57Wkt},
                    Input{"ply", make_ply, true, "EPSG:2994"}, Input{"pcd", make_pcd, false, ""},
                    Input{"ptx", make_ptx, true, ""}, Input{"csv", make_csv, false, ""}),
    [](const auto& test) { return std::string(test.param.name); });

class LasAgain : public ProgramTest {};

TEST_F(LasAgain, EveryFieldAndRecordIsThatOfTheScan) {
  const Made made = make_las(folder_);
  ASSERT_EQ(build({made.path, "--lossless-leaves", "--node-points", "60"}).exit_code, 0);
  const std::string back = folder_ / "back.las";
  ASSERT_EQ(cairn({"export", "--progress", "none", output(), "-o", back}).exit_code, 0);
  LasFile expected = read_las(made.path), found = read_las(back);
  EXPECT_EQ(found.format, 10);
  EXPECT_EQ(found.scale, expected.scale);
  rebase(found, expected.offset);
  std::ranges::sort(expected.points);
  std::ranges::sort(found.points);
  EXPECT_TRUE(found.points == expected.points);
  // The descriptor of the extra bytes, and the WKT, byte by byte.
  const std::string before = read_text(made.path), after = read_text(back);
  for (const char* word : {"Reflectance", "PROJCS"}) {
    const std::size_t size = word == std::string("PROJCS") ? 50 : 184;
    const std::size_t at = after.find(word);
    ASSERT_NE(at, std::string::npos);
    EXPECT_EQ(after.substr(at, size), before.substr(before.find(word), size)) << word;
  }
  const std::size_t entry = after.find("Reflectance") - 4;
  EXPECT_EQ(get_at<std::uint8_t>(after, entry + 2), 4);
  EXPECT_EQ(get_at<std::uint8_t>(after, entry + 3), 1 | 8 | 16);
  // And told to people.
  const nlohmann::json schema = info().at("schema");
  for (const nlohmann::json& attribute : schema)
    if (attribute.at("name") == "reflectance")
      EXPECT_EQ(attribute.at("las"), (nlohmann::json{{"name", "Reflectance"},
                                                     {"description", "in dB, r"},
                                                     {"scale", 0.01},
                                                     {"offset", -5.0},
                                                     {"no_data", -32768}}));
  EXPECT_EQ(info().at("crs").at("epsg"), 2994);
  EXPECT_EQ(info().at("crs").at("unit_metres"), 1);
}

}  // namespace
}  // namespace cairn::test
