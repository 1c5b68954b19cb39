#include "pipeline/export_format.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "formats/error.h"
#include "formats/lower_case.h"
#include "formats/scans/scan_writer.h"

namespace cairn::pipeline {
namespace {

std::vector<ExportFormat> make_formats() {
  std::vector<ExportFormat> list;
  for (const formats::ScanFormat& scan : formats::scan_formats())
    list.push_back({.name = scan.name, .suffixes = scan.suffixes, .write = export_scan});
  return list;
}

}  // namespace

std::span<const ExportFormat> export_formats() {
  static const std::vector<ExportFormat> kFormats = make_formats();
  return kFormats;
}

std::string export_format_names() {
  std::string names;
  const auto all = export_formats();
  for (const ExportFormat& format : all)
    names += fmt::format("{}{}",
                         &format == &all.front()  ? ""
                         : &format == &all.back() ? " or "
                                                  : ", ",
                         format.name);
  return names;
}

const ExportFormat& export_format(const std::string& name, const std::filesystem::path& output) {
  const auto all = export_formats();
  const std::string suffix = formats::lower_suffix(output);
  const auto at = std::ranges::find_if(all, [&](const ExportFormat& format) {
    return name.empty() ? std::ranges::find(format.suffixes, suffix) != format.suffixes.end()
                        : format.name == name;
  });
  if (at != all.end()) return *at;
  if (!name.empty())
    throw formats::Error(
        formats::ErrorKind::kUsage,
        {.what = "--format", .found = "'" + name + "'", .expected = export_format_names()});
  std::string suffixes;
  for (const ExportFormat& format : all)
    for (const std::string_view known : format.suffixes)
      suffixes += fmt::format("{}{}", suffixes.empty() ? "" : ", ", known);
  throw formats::Error(formats::ErrorKind::kUsage,
                       {.what = "the suffix of " + output.string() + " tells no format",
                        .found = "'" + suffix + "'",
                        .expected = suffixes + "; or --format " + export_format_names()});
}

std::uint64_t export_scan(const ExportFormat& format, const ExportJob& job) {
  const formats::ScanFormat& scan = *formats::scan_format_named(format.name);
  const formats::ScanInfo description =
      stages::describe_export(job.dataset, job.selection, scan.takes_steps);
  const auto writer = formats::create_scan_writer(scan, job.output, description,
                                                  description.claimed_points, job.force);
  const std::uint64_t written =
      stages::export_points(job.context, job.dataset, job.selection, description, *writer);
  if (written == 0) formats::throw_usage("no point lies inside the box: nothing is written");
  writer->finish();
  return written;
}

}  // namespace cairn::pipeline
