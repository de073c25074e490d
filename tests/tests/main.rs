//! The whole program against the oracle and against its claims, under validation and synchronisation validation.

mod atanasov;
mod borrowed;
mod chermain;
mod claims;
mod deliot_belcour;
mod flake_queries;
mod flakes;
mod foreign_models;
mod frames;
mod heuristics;
mod jakob;
mod jakob_counts;
mod kemppinen;
mod occlusion;
mod orientation;
mod precise;
mod settings;
mod shopf;
mod smooth;
mod stage;
mod wang2018;
mod wang2020_quadtree;
mod wang2020_shading;
mod wang2020_tables;
mod wang_bowles;
mod zirr_kaplanyan;
