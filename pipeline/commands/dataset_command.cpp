#include "pipeline/commands/dataset_command.h"

#include <CLI/CLI.hpp>

#include "formats/error.h"
#include "pipeline/memory_budget.h"

namespace cairn::pipeline {

DatasetCommand::DatasetCommand(CLI::App& program, const char* name, const char* about,
                               const char* footer)
    : parser_(*program.add_subcommand(name, about)) {
  parser_.footer(footer);
  parser_
      .add_option("dataset", dataset_,
                  "the dataset, a folder, or the address of one, http(s)://HOST/NAME.cairn")
      ->option_text("NAME.cairn")
      ->required();
  parser_
      .add_option("--web-cache", web_cache_,
                  "where what is fetched from an address is kept, a folder, or off [cairn in "
                  "$XDG_CACHE_HOME or ~/.cache]")
      ->option_text("FOLDER|off");
  parser_.add_option("--web-cache-size", web_cache_size_, "of that folder, at most [1GiB]")
      ->option_text("SIZE");
}

formats::DatasetReader DatasetCommand::open_dataset(const std::stop_token& stop) const {
  const auto bytes = parse_memory(web_cache_size_, 0);
  if (!bytes)
    throw formats::Error(formats::ErrorKind::kUsage, {.what = "--web-cache-size",
                                                      .found = "'" + web_cache_size_ + "'",
                                                      .expected = "a size such as 1GiB"});
  formats::AccessOptions options{.cache_bytes = *bytes, .stop = stop};
  options.must_cache = !web_cache_.empty();  // a home that cannot be written to is no failure
  if (!options.must_cache)
    options.cache_folder = formats::default_cache_folder();
  else if (web_cache_ != "off")
    options.cache_folder = web_cache_;
  return formats::DatasetReader::open(dataset_, options);
}

}  // namespace cairn::pipeline
