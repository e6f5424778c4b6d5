//! The `shapespace` command line as a library: files in, results out.
