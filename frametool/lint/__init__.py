"""Find mistakes in trees and recordings, and differences between trees."""
