//! What holds the house together: its layers, what is generated, the fuzzer's corpus.

mod architecture;
mod doc_comments;
mod fuzz_corpus;
mod generated;
mod layers;
mod physics_note;
