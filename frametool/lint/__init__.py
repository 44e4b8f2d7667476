"""What is wrong or odd in trees and recordings."""
